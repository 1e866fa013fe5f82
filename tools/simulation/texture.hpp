// Procedural surfaces and filtered sampling of pictures of them.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "tools/simulation/random.hpp"

namespace beckon::simulation {

// B, G, R, 0 to 255.
using Colour = cv::Vec3f;

enum class LookKind {
  kPlanks,  // floors
  kTiles,
  kCarpet,
  kStone,
  kLinoleum,
  kPlaster,  // walls
  kBrick,
  kStripes,
  kBoards,
  kWood,  // furniture and clothes
  kFabric,
  kCardboard,
  kPaint,
  kBooks,
  kMottle,  // patches of random colours and sizes: no surface of this world
};

struct Look {
  LookKind kind = LookKind::kPaint;
  Colour first{128, 128, 128};
  Colour second{96, 96, 96};
  std::uint32_t seed = 0;
  double size_m = 0.3;  // of tiles, planks, patches
};

Look RandomFloorLook(Random& random);
// Unlike `floor` in colour, so that a person could tell where the floor ends.
Look RandomWallLook(Random& random, const Colour& floor);
Look RandomFurnitureLook(Random& random, const Colour& floor);
// Any colours, patches of all sizes, those of 2 to 10 cm strongest.
Look RandomMottle(Random& random);

// Colour of the surface at a point of it, m. With `wraps` it repeats every kTileM in both
// directions.
inline constexpr float kTileM = 2.048F;
Colour Albedo(const Look& look, float x, float y, bool wraps);

// A picture and its halved copies, for lookups of any scale without aliasing.
class MipImage {
 public:
  // `image`: CV_8UC4 (B, G, R, unused). `wraps`: repeats in both directions; its sides are then
  // powers of two.
  MipImage(const cv::Mat& image, double texel_m, bool wraps);
  // A tile of a look, kTileM square.
  static MipImage Tile(const Look& look);

  double texel_m() const { return texel_m_; }
  int levels() const { return static_cast<int>(levels_.size()); }

  // Bilinear lookup in one level at a place in metres from the picture's first corner. Packed B, G,
  // R in the low three bytes.
  std::uint32_t Sample(int level, float x, float y) const;

 private:
  struct Level {
    cv::Mat image;  // owns the texels
    const std::uint32_t* texels;
    int stride;  // texels from row to row
    int last_column;
    int last_row;
    float texels_per_m;
  };
  void AddLevel(const cv::Mat& image, double texel_m);

  double texel_m_;
  bool wraps_;
  std::vector<Level> levels_;
};

// How to filter a surface that one pixel covers `minor_m` by `major_m` of: several lookups in a row
// along the longer side, in the level that fits the shorter one.
struct Footprint {
  std::uint8_t level;
  std::uint8_t taps;
  float step_m;  // between lookups, along the longer side
};
Footprint FootprintFor(double minor_m, double major_m, double texel_m, int levels);

// Mean of the footprint's lookups around (x, y), along the unit vector (along_x, along_y).
Colour SampleFootprint(const MipImage& image, const Footprint& footprint, float x, float y,
                       float along_x, float along_y);

}  // namespace beckon::simulation
