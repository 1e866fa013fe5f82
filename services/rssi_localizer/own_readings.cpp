#include "services/rssi_localizer/own_readings.hpp"

#include "common/csv.hpp"
#include "common/log.hpp"

namespace beckon {
namespace {

// A loss of power may have left half a line.
bool EndsWithinALine(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(-1, std::ios::end);
  return stream && stream.get() != '\n';
}

}  // namespace

OwnReadings::OwnReadings(const std::filesystem::path& file, int known, double window_s)
    : file_(file), count_(known), window_us_(UtimeFromSeconds(window_s)) {
  std::error_code error;
  const bool is_new = std::filesystem::file_size(file, error) == 0 || error;
  const bool broken = !is_new && EndsWithinALine(file);
  stream_.open(file, std::ios::app);
  if (is_new) stream_ << "utime,tag,beacon,rssi_dbm,x_m,y_m\n";
  if (broken) stream_ << '\n';
  if (!stream_.flush()) throw FileError(file, "cannot be written");
  stream_.setf(std::ios::fixed);
  stream_.precision(2);
}

bool OwnReadings::Add(const Reading& reading, const Eigen::Vector2d& position) {
  if (count_ >= kMostReadings) return true;
  const bool in_window = taken_at_ && reading.utime < window_end_;
  if (!in_window) {
    if (taken_at_ && (position - *taken_at_).norm() < kStepM) return true;
    taken_at_ = position;
    window_end_ = reading.utime + window_us_;
  }
  ++count_;
  stream_ << reading.utime << ',' << reading.tag << ',' << reading.beacon << ',' << reading.rssi_dbm
          << ',' << position.x() << ',' << position.y() << '\n';
  if (stream_.flush()) return true;
  LogWarning("what the robot hears can no longer be kept in " + file_.string());
  count_ = kMostReadings;
  return false;
}

}  // namespace beckon
