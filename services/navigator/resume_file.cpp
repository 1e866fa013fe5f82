#include "services/navigator/resume_file.hpp"

#include <fstream>
#include <string>

#include "common/log.hpp"

namespace beckon {
namespace {

constexpr char kHeader[] = "beckon-call-1";

}  // namespace

std::optional<Call> ResumeFile::Load(Utime now) const {
  if (path_.empty()) return std::nullopt;
  std::ifstream stream(path_);
  std::string header;
  std::string kind;
  Utime saved = 0;
  Call call;
  if (!(stream >> header >> saved >> call.utime >> kind) || header != kHeader) return std::nullopt;
  const double age_s = SecondsFromUtime(now - saved);
  if (age_s < -1.0 || age_s > within_s_) return std::nullopt;
  if (kind == "point") {
    call.kind = Call::Kind::kPoint;
    if (!(stream >> call.point.x() >> call.point.y())) return std::nullopt;
  } else if (kind == "tag") {
    call.kind = Call::Kind::kTag;
    stream.ignore(1);
    if (!std::getline(stream, call.tag) || call.tag.empty()) return std::nullopt;
  } else {
    return std::nullopt;
  }
  return call;
}

void ResumeFile::Save(Utime now, const std::optional<Call>& call) {
  if (path_.empty()) return;
  std::error_code error;
  if (!call) {
    std::filesystem::remove(path_, error);
    return;
  }
  std::filesystem::path fresh = path_;
  fresh += ".new";
  {
    std::ofstream stream(fresh, std::ios::trunc);
    stream.precision(17);
    stream << kHeader << ' ' << now << ' ' << call->utime << ' ';
    if (call->kind == Call::Kind::kPoint) {
      stream << "point " << call->point.x() << ' ' << call->point.y() << '\n';
    } else {
      stream << "tag " << call->tag << '\n';
    }
    if (!stream.flush()) error = std::make_error_code(std::errc::io_error);
  }
  if (!error) std::filesystem::rename(fresh, path_, error);
  if (error && !has_failed_) {
    has_failed_ = true;
    LogWarning("the call cannot be kept in " + path_.string() + ": " + error.message());
  }
}

}  // namespace beckon
