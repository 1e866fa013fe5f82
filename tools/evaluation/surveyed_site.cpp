#include "tools/evaluation/surveyed_site.hpp"

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "tools/simulation/folders.hpp"

namespace beckon {
namespace {

// A folder for the time of one statement or two.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = std::filesystem::temp_directory_path() / "beckon_site_XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace

SiteModel SurveyedSite(const simulation::World& world, const LocalizerOptions& options) {
  const ScratchFolder folder;
  simulation::WriteSite(folder.path(), world, {});
  const Site site = Site::Load(folder.path());
  return SiteModel::Fit(site, LoadCalibration(folder.path() / "calibration.csv", site), options);
}

}  // namespace beckon
