#include "tools/calibration/session.hpp"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "common/config.hpp"
#include "common/csv.hpp"

namespace beckon {
namespace {

cv::Mat ReadPicture(const std::filesystem::path& file) {
  cv::Mat picture;
  try {
    picture = cv::imread(file.string(), cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {  // larger than OpenCV reads
  }
  if (picture.empty()) throw FileError(file, "is not a picture that can be read");
  return picture;
}

// All pictures have to be of one camera in one mode.
void CheckSize(const std::filesystem::path& file, const cv::Mat& picture, cv::Size& size) {
  if (size.empty()) size = picture.size();
  if (picture.size() == size) return;
  throw FileError(file, "is " + std::to_string(picture.cols) + " x " +
                            std::to_string(picture.rows) + " pixels, but others are " +
                            std::to_string(size.width) + " x " + std::to_string(size.height) +
                            ": a calibration holds for one size");
}

std::vector<FloorMark> ReadMarks(const std::filesystem::path& file, const cv::Size& size) {
  std::vector<FloorMark> marks;
  CsvReader reader(file, {"u", "v", "x_m", "y_m"});
  while (reader.Next()) {
    FloorMark mark;
    mark.pixel = {reader.Number(0), reader.Number(1)};
    mark.floor_m = {reader.Number(2), reader.Number(3)};
    mark.name = file.filename().string() + ":" + std::to_string(reader.line());
    if (mark.pixel.x() < -0.5 || mark.pixel.x() > size.width - 0.5 || mark.pixel.y() < -0.5 ||
        mark.pixel.y() > size.height - 0.5) {
      reader.Fail("the pixel lies outside of a picture of " + std::to_string(size.width) + " x " +
                  std::to_string(size.height));
    }
    for (const FloorMark& other : marks) {
      if ((other.pixel - mark.pixel).norm() < 1e-9 || (other.floor_m - mark.floor_m).norm() < 1e-9)
        reader.Fail("says the same pixel or place as " + other.name);
    }
    marks.push_back(std::move(mark));
  }
  return marks;
}

std::vector<std::filesystem::path> PicturesIn(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".jpg" || extension == ".jpeg" || extension == ".png")
      files.push_back(entry.path());
  }
  if (files.empty()) throw FileError(folder, "holds no .jpg, .jpeg or .png files");
  std::sort(files.begin(), files.end());
  return files;
}

Lens LensOf(const std::filesystem::path& file, const cv::Size& size) {
  const GroundCamera camera = GroundCamera::Load(file);
  if (camera.width != size.width || camera.height != size.height) {
    throw FileError(file, "is for pictures of another size");
  }
  return {camera.fx, camera.fy, camera.cx, camera.cy, camera.distortion, 0.0};
}

void ReadToml(const SessionOptions& options, Session& session) {
  ConfigFile file(options.input);
  ConfigTable& root = file.root();
  MountInput& input = session.mount;
  double height_m = 0.0;
  root.Optional("camera_height_m", height_m, Range{0.0, 20.0});
  if (height_m > 0.0) input.camera_height_m = height_m;
  if (root.Has("camera_at")) root.Required("camera_at", input.camera_at);
  std::filesystem::path marks_file, picture_file, lens_folder;
  root.OptionalPath("marks", marks_file);
  root.OptionalPath("picture", picture_file);
  root.OptionalPath("lens_pictures", lens_folder);
  const std::vector<ConfigTable*> views = root.Tables("views");
  if (!views.empty() || !lens_folder.empty()) input.board = ReadBoard(root.Table("board"));

  std::vector<std::filesystem::path> paths(views.size());
  input.boards.resize(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i]->RequiredPath("picture", paths[i]);
    views[i]->Required("first_corner", input.boards[i].first_m);
    views[i]->Required("second_corner", input.boards[i].second_m);
  }
  file.Finish();

  if (!picture_file.empty()) {
    session.picture = ReadPicture(picture_file);
    CheckSize(picture_file, session.picture, input.size);
  }
  std::vector<std::vector<BoardCorner>> boards;  // in all pictures
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::filesystem::path& path = paths[i];
    FloorBoard& board = input.boards[i];
    const cv::Mat picture = ReadPicture(path);
    CheckSize(path, picture, input.size);
    board.name = path.filename().string();
    board.corners = FindBoard(picture, input.board, board.name);
    boards.push_back(board.corners);
    if (session.picture.empty()) session.picture = picture;
  }
  if (!lens_folder.empty()) {
    for (const std::filesystem::path& path : PicturesIn(lens_folder)) {
      const cv::Mat picture = ReadPicture(path);
      CheckSize(path, picture, input.size);
      boards.push_back(FindBoard(picture, input.board, path.filename().string()));
    }
    input.lens = CalibrateLens(boards, input.size);
    session.lens_pictures = boards.size();
  }
  if (!marks_file.empty()) {
    if (input.size.empty()) {
      throw CalibrationError(options.input.string() +
                             ": marks need a picture, for the size of the camera's pictures");
    }
    input.marks = ReadMarks(marks_file, input.size);
  }
}

}  // namespace

Session ReadSession(const SessionOptions& options) {
  Session session;
  if (!options.picture.empty()) {
    session.picture = ReadPicture(options.picture);
    CheckSize(options.picture, session.picture, session.mount.size);
  }
  if (options.input.extension() == ".csv") {
    if (options.picture.empty()) {
      throw CalibrationError(
          "a .csv of marks needs --picture, the picture that they were found in");
    }
    session.mount.marks = ReadMarks(options.input, session.mount.size);
  } else {
    ReadToml(options, session);
  }
  if (options.camera_height_m) session.mount.camera_height_m = options.camera_height_m;
  if (!options.lens.empty()) session.mount.lens = LensOf(options.lens, session.mount.size);
  return session;
}

}  // namespace beckon
