#include "tools/simulation/texture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace beckon::simulation {
namespace {

constexpr int kMaxTaps = 6;

std::uint32_t Hash(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
  std::uint32_t h = seed + 0x9e3779b9U * x + 0x85ebca6bU * y;
  h ^= h >> 16;
  h *= 0x7feb352dU;
  h ^= h >> 15;
  h *= 0x846ca68bU;
  h ^= h >> 16;
  return h;
}
float HashUnit(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
  return static_cast<float>(Hash(x, y, seed) >> 8) * 0x1.0p-24F;
}

std::uint32_t Cell(float value, int log2_cells, bool wraps) {
  const auto cell = static_cast<std::uint32_t>(static_cast<std::int32_t>(value));
  return wraps ? cell & ((1U << log2_cells) - 1U) : cell;
}

// Value noise in [0, 1]: 2^kx by 2^ky cells a tile.
float Noise(float x, float y, int kx, int ky, std::uint32_t seed, bool wraps) {
  const float u = x / kTileM * static_cast<float>(1 << kx);
  const float v = y / kTileM * static_cast<float>(1 << ky);
  const float u0 = std::floor(u);
  const float v0 = std::floor(v);
  const auto smooth = [](float t) { return t * t * (3.0F - 2.0F * t); };
  const float a = smooth(u - u0);
  const float b = smooth(v - v0);
  const std::uint32_t i0 = Cell(u0, kx, wraps);
  const std::uint32_t i1 = Cell(u0 + 1.0F, kx, wraps);
  const std::uint32_t j0 = Cell(v0, ky, wraps);
  const std::uint32_t j1 = Cell(v0 + 1.0F, ky, wraps);
  const float low = (1.0F - a) * HashUnit(i0, j0, seed) + a * HashUnit(i1, j0, seed);
  const float high = (1.0F - a) * HashUnit(i0, j1, seed) + a * HashUnit(i1, j1, seed);
  return (1.0F - b) * low + b * high;
}
float Noise(float x, float y, int k, std::uint32_t seed, bool wraps) {
  return Noise(x, y, k, k, seed, wraps);
}

// Worley noise: the nearest of scattered points, and how much nearer it is than the second.
struct Stone {
  std::uint32_t id;
  float margin;  // 0 on the border between two stones, in units of a cell
};
Stone NearestStone(float x, float y, int k, std::uint32_t seed, bool wraps) {
  const float u = x / kTileM * static_cast<float>(1 << k);
  const float v = y / kTileM * static_cast<float>(1 << k);
  const float u0 = std::floor(u);
  const float v0 = std::floor(v);
  float first = 1e9F;
  float second = 1e9F;
  std::uint32_t id = 0;
  for (int dj = -1; dj <= 1; ++dj) {
    for (int di = -1; di <= 1; ++di) {
      const float cell_u = u0 + static_cast<float>(di);
      const float cell_v = v0 + static_cast<float>(dj);
      const std::uint32_t hash = Hash(Cell(cell_u, k, wraps), Cell(cell_v, k, wraps), seed);
      const float du = cell_u + static_cast<float>(hash & 0xffffU) / 65536.0F - u;
      const float dv = cell_v + static_cast<float>(hash >> 16) / 65536.0F - v;
      const float squared = du * du + dv * dv;
      if (squared < first) {
        second = first;
        first = squared;
        id = hash;
      } else {
        second = std::min(second, squared);
      }
    }
  }
  return {id, std::sqrt(second) - std::sqrt(first)};
}

// 0 inside a joint of this width at multiples of `period`, 1 away from it.
float Joint(float value, float period, float width) {
  const float phase = value / period - std::floor(value / period);
  const float distance = std::min(phase, 1.0F - phase) * period;
  return std::clamp((distance - 0.5F * width) / 0.0015F + 0.5F, 0.0F, 1.0F);
}

Colour Mix(const Colour& a, const Colour& b, float t) { return a * (1.0F - t) + b * t; }

Colour FromHsv(double hue_deg, double saturation, double value) {
  const auto channel = [&](double n) {
    const double k = std::fmod(n + hue_deg / 60.0, 6.0);
    return 255.0 * value * (1.0 - saturation * std::max(0.0, std::min({k, 4.0 - k, 1.0})));
  };
  return {static_cast<float>(channel(1.0)), static_cast<float>(channel(3.0)),
          static_cast<float>(channel(5.0))};
}

Colour Planks(const Look& look, float x, float y) {
  const auto width = static_cast<float>(look.size_m);
  const float row = std::floor(y / width);
  const auto row_id = static_cast<std::uint32_t>(static_cast<std::int32_t>(row));
  const float length = 1.1F + 0.5F * HashUnit(row_id, 7, look.seed);
  const float shifted = x + 1.7F * HashUnit(row_id, 11, look.seed);
  const auto board =
      static_cast<std::uint32_t>(static_cast<std::int32_t>(std::floor(shifted / length)));
  const float tint = HashUnit(board, row_id, look.seed);
  const float grain = 0.5F * Noise(x, y + 3.1F * tint, 3, 8, look.seed, false) +
                      0.5F * Noise(x, y + 5.3F * tint, 5, 9, look.seed + 1, false);
  const float shade = 0.86F + 0.18F * tint + 0.16F * (grain - 0.5F);
  const float joint = std::min(Joint(y, width, 0.003F), Joint(shifted, length, 0.003F));
  return Mix(look.second * 0.5F, Mix(look.first, look.second, 0.35F * grain) * shade, joint);
}

Colour Tiles(const Look& look, float x, float y) {
  const auto size = static_cast<float>(look.size_m);
  const auto i = static_cast<std::uint32_t>(static_cast<std::int32_t>(std::floor(x / size)));
  const auto j = static_cast<std::uint32_t>(static_cast<std::int32_t>(std::floor(y / size)));
  const float tint = HashUnit(i, j, look.seed);
  const float marble = 0.5F * Noise(x + 2.0F * tint, y, 5, look.seed, false) +
                       0.3F * Noise(x, y + 2.0F * tint, 7, look.seed + 1, false) +
                       0.2F * Noise(x, y, 9, look.seed + 2, false);
  const float joint = std::min(Joint(x, size, 0.005F), Joint(y, size, 0.005F));
  return Mix(look.second, look.first * (0.84F + 0.08F * tint + 0.24F * (marble - 0.3F)), joint);
}

Colour StoneFloor(const Look& look, float x, float y, bool wraps) {
  const Stone stone = NearestStone(x, y, 5, look.seed, wraps);
  const float tint = static_cast<float>(stone.id & 0xffU) / 255.0F;
  const float fine = Noise(x, y, 8, look.seed + 1, wraps);
  const float edge = std::clamp((stone.margin - 0.05F) / 0.06F, 0.0F, 1.0F);
  return Mix(look.second, look.first * (0.82F + 0.22F * tint + 0.1F * (fine - 0.5F)), edge);
}

Colour Brick(const Look& look, float x, float y, bool wraps) {
  const float course_m = kTileM / 32.0F;
  const float brick_m = kTileM / 8.0F;
  const float course = std::floor(y / course_m);
  const std::uint32_t j = Cell(course, 5, wraps);
  const float shifted = x + ((j & 1U) != 0 ? 0.5F * brick_m : 0.0F);
  const std::uint32_t i = Cell(std::floor(shifted / brick_m), 3, wraps);
  const float tint = HashUnit(i, j, look.seed);
  const float fine = Noise(x, y, 8, look.seed + 1, wraps);
  const float joint = std::min(Joint(y, course_m, 0.009F), Joint(shifted, brick_m, 0.009F));
  return Mix(look.second, look.first * (0.78F + 0.3F * tint + 0.16F * (fine - 0.5F)), joint);
}

Colour Books(const Look& look, float x, float y, bool wraps) {
  const float spine_m = kTileM / 64.0F;
  const float shelf_m = kTileM / 8.0F;
  const std::uint32_t i = Cell(std::floor(x / spine_m), 6, wraps);
  const std::uint32_t j = Cell(std::floor(y / shelf_m), 3, wraps);
  const Colour spine =
      FromHsv(360.0F * HashUnit(i, j, look.seed), 0.2F + 0.5F * HashUnit(i, j, look.seed + 1),
              0.3F + 0.5F * HashUnit(i, j, look.seed + 2));
  const float fine = Noise(x, y, 8, look.seed + 3, wraps);
  const float joint = std::min(Joint(x, spine_m, 0.003F), Joint(y, shelf_m, 0.02F));
  return Mix(look.first * 0.6F, spine * (0.95F + 0.1F * fine), joint);
}

// Noise of all sizes, each channel for itself, strongest at the look's own size. Like most that is
// found in nature it falls off slowly with size, so that there are corners from near and far.
Colour Mottle(const Look& look, float x, float y, bool wraps) {
  constexpr int kLargest = 2;  // 2^k patches a tile
  constexpr int kSmallest = 9;
  const float centre = std::log2(kTileM / static_cast<float>(look.size_m));
  Colour sum(0, 0, 0);
  float squares = 0.0F;
  for (int k = kLargest; k <= kSmallest; ++k) {
    const float octaves = static_cast<float>(k) - centre;
    const float weight = std::exp(-0.06F * octaves * octaves);
    const std::uint32_t seed = look.seed + 16U * static_cast<std::uint32_t>(k);
    for (int channel = 0; channel < 3; ++channel) {
      const float noise = Noise(x, y, k, seed + static_cast<std::uint32_t>(channel), wraps);
      sum[channel] += weight * (noise - 0.5F);
    }
    squares += weight * weight;
  }
  Colour colour;
  for (int channel = 0; channel < 3; ++channel) {
    // The same spread between the colours, however many octaves share it.
    const float part = std::clamp(0.5F + sum[channel] / std::sqrt(squares), 0.0F, 1.0F);
    colour[channel] = look.first[channel] * (1.0F - part) + look.second[channel] * part;
  }
  return colour;
}

struct Limits {
  double min;
  double max;
};
Colour RandomColour(Random& random, Limits hue_deg, Limits saturation, Limits value) {
  const double v = random.Uniform(value.min, value.max);
  const double s = random.Uniform(saturation.min, saturation.max);
  const double h = random.Uniform(hue_deg.min, hue_deg.max);
  return FromHsv(h, s, v);
}

// A colour at least this far from the floor's, so that it is not lost on it.
Colour Unlike(const Colour& floor, Random& random, double max_saturation, double min_value,
              double max_value) {
  constexpr double kLeastDifference = 60.0;
  Colour best;
  double best_difference = -1.0;
  for (int i = 0; i < 12 && best_difference < kLeastDifference; ++i) {
    const Colour colour =
        RandomColour(random, {0.0, 360.0}, {0.0, max_saturation}, {min_value, max_value});
    const double difference = cv::norm(colour - floor);
    if (difference > best_difference) {
      best_difference = difference;
      best = colour;
    }
  }
  return best;
}

Look MakeLook(LookKind kind, const Colour& first, const Colour& second, Random& random) {
  Look look;
  look.kind = kind;
  look.first = first;
  look.second = second;
  look.seed = static_cast<std::uint32_t>(random.Bits());
  return look;
}

}  // namespace

Look RandomFloorLook(Random& random) {
  static constexpr LookKind kKinds[] = {LookKind::kPlanks, LookKind::kTiles, LookKind::kCarpet,
                                        LookKind::kStone, LookKind::kLinoleum};
  const LookKind kind = kKinds[random.Integer(0, 4)];
  const bool wooden = kind == LookKind::kPlanks;
  const Colour first = wooden ? RandomColour(random, {20.0, 38.0}, {0.3, 0.6}, {0.5, 0.85})
                              : RandomColour(random, {0.0, 360.0}, {0.03, 0.3}, {0.45, 0.85});
  Look look = MakeLook(kind, first, first * static_cast<float>(random.Uniform(0.55, 0.75)), random);
  look.size_m = wooden ? random.Uniform(0.09, 0.18) : random.Uniform(0.28, 0.45);
  return look;
}

Look RandomWallLook(Random& random, const Colour& floor) {
  static constexpr LookKind kKinds[] = {LookKind::kPlaster, LookKind::kPlaster, LookKind::kBrick,
                                        LookKind::kStripes, LookKind::kBoards};
  const LookKind kind = kKinds[random.Integer(0, 4)];
  const Colour first = Unlike(floor, random, 0.25, 0.6, 0.95);
  return MakeLook(kind, first, first * static_cast<float>(random.Uniform(0.7, 0.88)), random);
}

Look RandomFurnitureLook(Random& random, const Colour& floor) {
  static constexpr LookKind kKinds[] = {LookKind::kWood,  LookKind::kFabric, LookKind::kCardboard,
                                        LookKind::kPaint, LookKind::kBooks,  LookKind::kStripes};
  const LookKind kind = kKinds[random.Integer(0, 5)];
  const Colour first = Unlike(floor, random, 0.75, 0.12, 0.9);
  return MakeLook(kind, first, first * static_cast<float>(random.Uniform(0.55, 0.8)), random);
}

Look RandomMottle(Random& random) {
  const Colour first = RandomColour(random, {0.0, 360.0}, {0.0, 0.5}, {0.6, 0.95});
  const Colour second = RandomColour(random, {0.0, 360.0}, {0.0, 0.5}, {0.1, 0.4});
  Look look = MakeLook(LookKind::kMottle, first, second, random);
  look.size_m = 0.02 * std::pow(5.0, random.Uniform());
  return look;
}

Colour Albedo(const Look& look, float x, float y, bool wraps) {
  const auto noise = [&](int k, std::uint32_t n) { return Noise(x, y, k, look.seed + n, wraps); };
  switch (look.kind) {
    case LookKind::kPlanks:
      return Planks(look, x, y);
    case LookKind::kTiles:
      return Tiles(look, x, y);
    case LookKind::kCarpet:
      return look.first * (0.7F + 0.12F * noise(3, 0) + 0.18F * noise(7, 1) + 0.28F * noise(9, 2));
    case LookKind::kStone:
      return StoneFloor(look, x, y, wraps);
    case LookKind::kLinoleum:
      return Mix(look.first, look.second, std::clamp(6.0F * (noise(8, 0) - 0.72F), 0.0F, 0.8F)) *
             (0.93F + 0.1F * noise(4, 1) + 0.05F * noise(9, 2));
    case LookKind::kPlaster:
      return look.first * (0.92F + 0.06F * noise(3, 0) + 0.04F * noise(6, 1) + 0.05F * noise(9, 2));
    case LookKind::kBrick:
      return Brick(look, x, y, wraps);
    case LookKind::kStripes: {
      const float phase = x / (kTileM / 16.0F) - std::floor(x / (kTileM / 16.0F));
      const float stripe = std::clamp((std::abs(phase - 0.5F) - 0.25F) * 60.0F + 0.5F, 0.0F, 1.0F);
      return Mix(look.first, look.second, stripe) * (0.95F + 0.08F * noise(8, 0));
    }
    case LookKind::kBoards: {
      const std::uint32_t board = Cell(std::floor(x / (kTileM / 16.0F)), 4, wraps);
      const float grain = Noise(x, y, 8, 4, look.seed, wraps);
      return Mix(look.second * 0.6F,
                 look.first * (0.85F + 0.12F * HashUnit(board, 3, look.seed) + 0.12F * grain),
                 Joint(x, kTileM / 16.0F, 0.006F));
    }
    case LookKind::kWood:
      return Mix(look.first, look.second,
                 0.6F * Noise(x, y, 2, 6, look.seed, wraps) +
                     0.4F * Noise(x, y, 4, 9, look.seed + 1, wraps));
    case LookKind::kFabric:
      return look.first * (0.72F + 0.2F * noise(7, 0) + 0.22F * noise(9, 1));
    case LookKind::kCardboard: {
      const float tape = Joint(y + 0.21F, kTileM / 4.0F, 0.05F);
      return Mix(look.second, look.first, tape) *
             (0.9F + 0.08F * noise(5, 0) + 0.06F * noise(9, 1));
    }
    case LookKind::kPaint:
      return look.first * (0.95F + 0.04F * noise(4, 0) + 0.04F * noise(8, 1));
    case LookKind::kBooks:
      return Books(look, x, y, wraps);
    case LookKind::kMottle:
      return Mottle(look, x, y, wraps);
  }
  return look.first;
}

MipImage::MipImage(const cv::Mat& image, double texel_m, bool wraps)
    : texel_m_(texel_m), wraps_(wraps) {
  CV_Assert(image.type() == CV_8UC4);
  AddLevel(image, texel_m);
  // Only sides that halve exactly: otherwise far texture would drift against near texture.
  while (levels_.back().image.cols % 2 == 0 && levels_.back().image.rows % 2 == 0) {
    cv::Mat half;
    cv::resize(levels_.back().image, half, {}, 0.5, 0.5, cv::INTER_AREA);
    texel_m *= 2.0;
    AddLevel(half, texel_m);
  }
}

void MipImage::AddLevel(const cv::Mat& image, double texel_m) {
  levels_.push_back({image, image.ptr<std::uint32_t>(),
                     static_cast<int>(image.step / sizeof(std::uint32_t)), image.cols - 1,
                     image.rows - 1, static_cast<float>(1.0 / texel_m)});
}

MipImage MipImage::Tile(const Look& look) {
  constexpr int kSide = 512;
  constexpr float kTexelM = kTileM / kSide;
  cv::Mat image(kSide, kSide, CV_8UC4);
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      const Colour colour = Albedo(look, (static_cast<float>(column) + 0.5F) * kTexelM,
                                   (static_cast<float>(row) + 0.5F) * kTexelM, true);
      image.at<cv::Vec4b>(row, column) = {cv::saturate_cast<std::uint8_t>(colour[0]),
                                          cv::saturate_cast<std::uint8_t>(colour[1]),
                                          cv::saturate_cast<std::uint8_t>(colour[2]), 0};
    }
  }
  return MipImage(image, kTexelM, true);
}

std::uint32_t MipImage::Sample(int level, float x, float y) const {
  const Level& mip = levels_[static_cast<std::size_t>(level)];
  // In 1/256 of a texel; the shift rounds down on both sides of zero, which costs less than
  // floor().
  const auto u = static_cast<std::int32_t>(256.0F * (x * mip.texels_per_m - 0.5F));
  const auto v = static_cast<std::int32_t>(256.0F * (y * mip.texels_per_m - 0.5F));
  const auto a = static_cast<std::uint32_t>(u & 0xff);
  const auto b = static_cast<std::uint32_t>(v & 0xff);
  int i0 = u >> 8;
  int j0 = v >> 8;
  int i1 = i0 + 1;
  int j1 = j0 + 1;
  if (wraps_) {  // the sides are powers of two
    i0 &= mip.last_column;
    i1 &= mip.last_column;
    j0 &= mip.last_row;
    j1 &= mip.last_row;
  } else {
    i0 = std::clamp(i0, 0, mip.last_column);
    i1 = std::clamp(i1, 0, mip.last_column);
    j0 = std::clamp(j0, 0, mip.last_row);
    j1 = std::clamp(j1, 0, mip.last_row);
  }
  const std::uint32_t* row0 = mip.texels + static_cast<std::ptrdiff_t>(j0) * mip.stride;
  const std::uint32_t* row1 = mip.texels + static_cast<std::ptrdiff_t>(j1) * mip.stride;
  // Two channels at a time, in 16-bit halves of a word.
  const auto blend = [](std::uint32_t p, std::uint32_t q, std::uint32_t weight) {
    const std::uint32_t even = ((p & 0xff00ffU) * (256U - weight) + (q & 0xff00ffU) * weight) >> 8;
    const std::uint32_t odd =
        ((p >> 8) & 0xff00ffU) * (256U - weight) + ((q >> 8) & 0xff00ffU) * weight;
    return (even & 0xff00ffU) | (odd & 0xff00ff00U);
  };
  return blend(blend(row0[i0], row0[i1], a), blend(row1[i0], row1[i1], a), b);
}

Footprint FootprintFor(double minor_m, double major_m, double texel_m, int levels) {
  // Never more than kMaxTaps lookups: what is longer is blurred across as well.
  const double finest_m = std::max(minor_m, major_m / kMaxTaps);
  // The level whose texels come nearest in size; sqrt(1/2) rounds the logarithm.
  const int exponent = std::ilogb(std::max(1.0, finest_m / texel_m) / std::numbers::sqrt2 * 2.0);
  const int level = std::clamp(exponent, 0, levels - 1);
  const double level_m = std::ldexp(texel_m, level);
  const int taps = std::clamp(static_cast<int>(std::lround(major_m / level_m)), 1, kMaxTaps);
  return {static_cast<std::uint8_t>(level), static_cast<std::uint8_t>(taps),
          static_cast<float>(major_m / taps)};
}

Colour SampleFootprint(const MipImage& image, const Footprint& footprint, float x, float y,
                       float along_x, float along_y) {
  std::uint32_t even = 0;  // blue and red, 16 bits each
  std::uint32_t odd = 0;   // green
  float offset = -0.5F * footprint.step_m * static_cast<float>(footprint.taps - 1);
  for (int i = 0; i < footprint.taps; ++i) {
    const std::uint32_t sample =
        image.Sample(footprint.level, x + offset * along_x, y + offset * along_y);
    even += sample & 0xff00ffU;
    odd += (sample >> 8) & 0xffU;
    offset += footprint.step_m;
  }
  const float scale = 1.0F / static_cast<float>(footprint.taps);
  return {static_cast<float>(even & 0xffffU) * scale, static_cast<float>(odd) * scale,
          static_cast<float>(even >> 16) * scale};
}

}  // namespace beckon::simulation
