// The call that is being answered, kept where a restarted navigator finds it.
#pragma once

#include <filesystem>
#include <optional>

#include "services/navigator/types.hpp"

namespace beckon {

class ResumeFile {
 public:
  // `path` empty: nothing is kept.
  ResumeFile(std::filesystem::path path, double within_s)
      : path_(std::move(path)), within_s_(within_s) {}

  // The call that was being answered up to `within_s` ago. A file that is damaged or too old is no
  // call.
  std::optional<Call> Load(Utime now) const;
  // Called while a call is answered, about once a second; nothing: there is no call any more. The
  // file is replaced as a whole. A folder that cannot be written is logged once.
  void Save(Utime now, const std::optional<Call>& call);

 private:
  std::filesystem::path path_;
  double within_s_;
  bool has_failed_ = false;
};

}  // namespace beckon
