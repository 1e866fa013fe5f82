#include "services/camera_grabber/http_source.hpp"

#include <httplib.h>

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <thread>
#include <utility>

#include "services/camera_grabber/multipart_parser.hpp"

namespace beckon {
namespace {

constexpr std::chrono::seconds kConnectTimeout{2};
// Silence is judged by whoever calls Next(); this only bounds how long a dead connection is held.
constexpr std::chrono::seconds kReadTimeout{2};

class HttpSource : public FrameSource {
 public:
  HttpSource(const std::string& url, const Clock& clock)
      : url_(url), parsed_(ParseHttpUrl(url)), clock_(clock), client_(parsed_.origin) {
    client_.set_connection_timeout(kConnectTimeout);
    client_.set_read_timeout(kReadTimeout);
    client_.set_follow_location(true);
    reader_ = std::thread([this] { Read(); });
  }

  ~HttpSource() override {
    ending_ = true;
    client_.stop();
    reader_.join();
  }

  std::optional<Frame> Next(std::chrono::milliseconds timeout) override {
    std::optional<MultipartParser::Part> part;
    Utime arrival = 0;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, timeout, [&] { return newest_.has_value() || finished_; });
      if (!newest_) {
        if (finished_) throw SourceError(reason_);
        return std::nullopt;
      }
      part = std::move(newest_);
      newest_.reset();
      arrival = arrival_;
    }
    return FrameFromJpeg(CaptureTime(part->headers["x-timestamp"], arrival), std::move(part->body),
                         "a frame from " + url_);
  }

  std::int64_t TakeDropped() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(dropped_, 0);
  }

 private:
  void Read() {
    std::optional<MultipartParser> parser;
    std::string refusal;
    const auto result = client_.Get(
        parsed_.path,
        [&](const httplib::Response& response) {
          const std::string type = response.get_header_value("Content-Type");
          const std::string boundary = MultipartParser::BoundaryOf(type);
          if (response.status != 200) {
            refusal = url_ + " answers with HTTP status " + std::to_string(response.status);
          } else if (boundary.empty()) {
            refusal = url_ + " sends '" + type + "', not multipart/x-mixed-replace with a boundary";
          } else {
            parser.emplace(boundary);
          }
          return refusal.empty();
        },
        [&](const char* data, std::size_t size) {
          for (MultipartParser::Part& part : parser->Feed({data, size})) Offer(std::move(part));
          return !ending_;
        });
    const std::lock_guard lock(mutex_);
    finished_ = true;
    if (!refusal.empty()) {
      reason_ = refusal;
    } else if (result) {
      reason_ = url_ + " ended the stream";
    } else if (parser) {
      reason_ = "the stream from " + url_ + " broke off";
    } else if (result.error() == httplib::Error::Connection) {
      reason_ = "no connection to " + url_;
    } else {
      reason_ = "no stream from " + url_ + ": " + httplib::to_string(result.error());
    }
    changed_.notify_all();
  }

  void Offer(MultipartParser::Part part) {
    const Utime arrival = clock_.Now().utime;
    {
      const std::lock_guard lock(mutex_);
      dropped_ += newest_.has_value();
      newest_ = std::move(part);
      arrival_ = arrival;
    }
    changed_.notify_all();
  }

  const std::string url_;
  const HttpUrl parsed_;
  const Clock& clock_;
  httplib::Client client_;
  std::atomic<bool> ending_ = false;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<MultipartParser::Part> newest_;
  Utime arrival_ = 0;
  std::int64_t dropped_ = 0;
  bool finished_ = false;
  std::string reason_;

  std::thread reader_;
};

}  // namespace

HttpUrl ParseHttpUrl(const std::string& url) {
  const std::string_view kScheme = url.starts_with("https://") ? "https://" : "http://";
  if (!url.starts_with(kScheme) || url.size() == kScheme.size()) {
    throw SourceError("'" + url + "' is not an http:// or https:// address");
  }
  const auto slash = url.find('/', kScheme.size());
  if (slash == std::string::npos) return {url, "/"};
  return {url.substr(0, slash), url.substr(slash)};
}

Utime CaptureTime(const std::string& timestamp, Utime arrival) {
  if (timestamp.empty()) return arrival;
  char* end = nullptr;
  const double seconds = std::strtod(timestamp.c_str(), &end);
  if (end != timestamp.c_str() + timestamp.size() || !std::isfinite(seconds)) return arrival;
  if (std::abs(seconds - SecondsFromUtime(arrival)) >
      std::chrono::duration<double>(kMaxClockDifference).count()) {
    return arrival;
  }
  return UtimeFromSeconds(seconds);
}

std::unique_ptr<FrameSource> OpenHttpSource(const std::string& url, const Clock& clock) {
  return std::make_unique<HttpSource>(url, clock);
}

}  // namespace beckon
