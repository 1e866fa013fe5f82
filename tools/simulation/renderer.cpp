#include "tools/simulation/renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "common/label_runs.hpp"
#include "tools/simulation/floor_picture.hpp"
#include "tools/simulation/lighting.hpp"
#include "tools/simulation/random.hpp"
#include "tools/simulation/texture.hpp"

namespace beckon::simulation {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kSectors = 1024;  // of azimuth
constexpr int kMaxCorners = 4;  // of a footprint
constexpr int kTopFace = 7;
constexpr int kFacesPerSolid = 8;
constexpr float kLightStepM = 0.05F;  // between samples of light along a face
constexpr int kRoundSamples = 32;     // of light round a cylinder
constexpr float kSkirtingM = 0.07F;   // heights at which the look changes
constexpr float kShoesM = 0.09F;
constexpr float kWaistM = 0.85F;

// One ray of the camera, in the robot frame.
struct Ray {
  float x, y;   // unit vector in the plane
  float slope;  // fall per metre along it, positive downwards
  int sector;
};

struct Hit {
  float range = kInfinity;  // along the plane, m
  int solid = -1;           // -1: floor
  int face = 0;
  std::uint16_t Id() const {
    return static_cast<std::uint16_t>(solid < 0 ? 0 : 1 + solid * kFacesPerSolid + face);
  }
};

// Footprint in the robot frame, with all that does not depend on the ray worked out.
struct Body {
  bool is_cylinder;
  int corners;
  float centre_x, centre_y, radius, radius_squared_minus_distance_squared;
  std::array<float, kMaxCorners> corner_x, corner_y, edge_x, edge_y, edge_length, inside;
  float height;
};

// How a surface looks, as it stands in the map.
struct Skin {
  int tile = -1;  // -1: that of the room in front, for walls
  bool is_person = false;
  float phase = 0.0F;  // shifts the texture, m
  // Light per face along its length, or round a cylinder; and for walls the tile.
  std::array<std::vector<float>, kMaxCorners> light;
  std::array<std::vector<std::uint8_t>, kMaxCorners> wall_tile;
};

Body BodyOf(const Solid& solid) {
  Body body{};
  body.is_cylinder = solid.is_cylinder();
  body.height = static_cast<float>(solid.height_m);
  body.centre_x = static_cast<float>(solid.centre.x());
  body.centre_y = static_cast<float>(solid.centre.y());
  body.radius = static_cast<float>(solid.radius);
  body.radius_squared_minus_distance_squared =
      static_cast<float>(solid.radius * solid.radius - solid.centre.squaredNorm());
  body.corners = static_cast<int>(solid.footprint.size());
  CV_Assert(body.corners <= kMaxCorners);
  for (int i = 0; i < body.corners; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const Eigen::Vector2d& from = solid.footprint[index];
    const Eigen::Vector2d edge = solid.footprint[(index + 1) % solid.footprint.size()] - from;
    body.corner_x[index] = static_cast<float>(from.x());
    body.corner_y[index] = static_cast<float>(from.y());
    body.edge_x[index] = static_cast<float>(edge.x());
    body.edge_y[index] = static_cast<float>(edge.y());
    body.edge_length[index] = static_cast<float>(edge.norm());
    body.inside[index] = static_cast<float>(edge.y() * from.x() - edge.x() * from.y());
  }
  return body;
}

// The same geometry as Cross(), from the origin and in single precision: this is the innermost
// loop.
bool CrossBody(const Body& body, float x, float y, float& enter, float& leave, int& face) {
  if (body.is_cylinder) {
    const float closest = body.centre_x * x + body.centre_y * y;
    const float squared = body.radius_squared_minus_distance_squared + closest * closest;
    if (squared <= 0.0F) return false;
    const float half_chord = std::sqrt(squared);
    enter = closest - half_chord;
    leave = closest + half_chord;
    face = 0;
    return enter > 0.0F;
  }
  enter = 0.0F;
  leave = kInfinity;
  face = -1;
  for (int i = 0; i < body.corners; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const float slope = body.edge_x[index] * y - body.edge_y[index] * x;
    if (slope > 0.0F) {
      const float t = -body.inside[index] / slope;
      if (t > enter) {
        enter = t;
        face = i;
      }
    } else if (slope < 0.0F) {
      leave = std::min(leave, -body.inside[index] / slope);
    } else if (body.inside[index] < 0.0F) {
      return false;
    }
  }
  return face >= 0 && leave > enter;
}

}  // namespace

class Renderer::Impl {
 public:
  Impl(const World& world, const GroundCamera& camera, const RenderOptions& options);
  cv::Mat Render(const Pose2& map_from_robot, const std::vector<Solid>& people, std::uint64_t frame,
                 cv::Mat* labels);

 private:
  struct Pixel {
    Ray ray;
    float ideal_x, ideal_y;    // of the ray, on the plane at distance 1 before the camera
    float ground_x, ground_y;  // where it meets the floor, robot frame, m
    Footprint ground;
  };
  struct Candidate {
    float nearest;  // m, no ray of the sector meets it before
    int solid;
  };

  void PrepareRays();
  Ray RayThrough(float ideal_x, float ideal_y) const;
  Skin MakeSkin(const Solid& solid, int tile);
  float RoundLight(const Solid& solid, int sample) const;
  void SortIntoSectors();
  Hit Trace(const Ray& ray) const;
  Colour Shade(const Ray& ray, const Hit& hit) const;
  Colour ShadeFloor(float x, float y, const Footprint& footprint, float along_x,
                    float along_y) const;
  Colour ShadeSide(const Ray& ray, const Hit& hit) const;
  Colour ShadeTop(const Ray& ray, const Hit& hit) const;
  Colour Supersample(const Pixel& pixel) const;
  void AddNoise(std::uint64_t frame, cv::Mat& image) const;

  const World world_;
  const GroundCamera camera_;
  const RenderOptions options_;
  const float height_;  // of the camera, m
  Random look_random_;
  Lighting lighting_;
  std::vector<MipImage> tiles_;  // walls of each room, then furniture, then clothes
  std::unique_ptr<MipImage> floor_;
  int clothes_tile_ = 0;  // shoes, trousers, shirt
  bool has_skirting_ = false;
  Colour skirting_;
  std::vector<Skin> skins_;

  std::vector<Pixel> pixels_;
  float max_azimuth_ = 0.0F;
  std::vector<Eigen::Vector2f> sector_edges_;  // kSectors + 1 unit vectors
  std::vector<std::int8_t> noise_;

  // Of the frame in work.
  Pose2 map_from_robot_;
  float cosine_ = 1.0F;  // of its heading
  float sine_ = 0.0F;
  float map_x_ = 0.0F;  // its place in the floor's picture, m
  float map_y_ = 0.0F;
  std::vector<Body> bodies_;
  std::vector<Skin> people_skins_;
  std::size_t first_person_ = 0;
  std::vector<std::vector<Candidate>> sectors_;
  std::vector<float> sector_nearest_;
};

Renderer::Impl::Impl(const World& world, const GroundCamera& camera, const RenderOptions& options)
    : world_(world),
      camera_(camera),
      options_(options),
      height_(static_cast<float>(camera.height_m)),
      look_random_(world.seed, Stream::kLook),
      lighting_(options.one_look ? Lighting::Even() : Lighting(world_, look_random_)) {
  std::vector<Look> floors;
  for (std::size_t i = 0; i < world_.rooms.size(); ++i) {
    // Now and then one covering goes through two rooms.
    const bool same = i > 0 && look_random_.Chance(0.4);
    floors.push_back(same ? floors.back() : RandomFloorLook(look_random_));
    if (options_.one_look) floors.back() = *options_.one_look;
    tiles_.push_back(MipImage::Tile(
        options_.one_look.value_or(RandomWallLook(look_random_, floors.back().first))));
  }
  floor_ = std::make_unique<MipImage>(
      PaintFloor(world_, floors, lighting_, options_.texel_m, look_random_));
  has_skirting_ = look_random_.Chance(0.5) && !options_.one_look;
  const auto grey = static_cast<float>(look_random_.Uniform(60.0, 230.0));
  skirting_ = Colour(grey, grey, grey);

  for (const Solid& solid : world_.solids) {
    int tile = -1;
    if (solid.kind == SolidKind::kFurniture) {
      tile = static_cast<int>(tiles_.size());
      tiles_.push_back(MipImage::Tile(
          options_.one_look.value_or(RandomFurnitureLook(look_random_, floors[0].first))));
    }
    skins_.push_back(MakeSkin(solid, tile));
  }
  clothes_tile_ = static_cast<int>(tiles_.size());
  for (int i = 0; i < 3; ++i) {
    Look look = RandomFurnitureLook(look_random_, floors[0].first);
    look.kind = i == 0 ? LookKind::kPaint : LookKind::kFabric;
    if (i == 0) look.first = Colour(40, 40, 45);
    tiles_.push_back(MipImage::Tile(look));
  }

  Random noise_random(world_.seed, Stream::kCameraNoise);
  noise_.resize(1U << 17U);
  for (std::int8_t& value : noise_) {
    value = cv::saturate_cast<std::int8_t>(options_.noise_sigma * noise_random.Normal());
  }
  PrepareRays();
}

float Renderer::Impl::RoundLight(const Solid& solid, int sample) const {
  const double angle = 2.0 * std::numbers::pi * sample / kRoundSamples;
  const Eigen::Vector2d normal(std::cos(angle), std::sin(angle));
  return lighting_.OnUpright(solid.centre + solid.radius * normal, normal);
}

Skin Renderer::Impl::MakeSkin(const Solid& solid, int tile) {
  Skin skin;
  skin.tile = tile;
  skin.is_person = solid.kind == SolidKind::kPerson;
  skin.phase = static_cast<float>(look_random_.Uniform(0.0, kTileM));
  if (solid.is_cylinder()) {
    for (int i = 0; i < kRoundSamples; ++i) skin.light[0].push_back(RoundLight(solid, i));
    return skin;
  }
  for (std::size_t face = 0; face < solid.footprint.size(); ++face) {
    const Eigen::Vector2d from = solid.footprint[face];
    const Eigen::Vector2d edge = solid.footprint[(face + 1) % solid.footprint.size()] - from;
    const Eigen::Vector2d along = edge.normalized();
    const Eigen::Vector2d normal(along.y(), -along.x());
    const int samples = 2 + static_cast<int>(edge.norm() / static_cast<double>(kLightStepM));
    for (int i = 0; i < samples; ++i) {
      const Eigen::Vector2d point =
          from + along * std::min(edge.norm(), i * static_cast<double>(kLightStepM));
      skin.light[face].push_back(lighting_.OnUpright(point, normal));
      std::size_t room = 0;
      for (std::size_t r = 0; r < world_.rooms.size(); ++r) {
        if (world_.rooms[r].Contains(point + 0.05 * normal)) room = r;
      }
      skin.wall_tile[face].push_back(static_cast<std::uint8_t>(room));
    }
  }
  return skin;
}

Ray Renderer::Impl::RayThrough(float ideal_x, float ideal_y) const {
  const auto cosine = static_cast<float>(std::cos(camera_.tilt_down_rad));
  const auto sine = static_cast<float>(std::sin(camera_.tilt_down_rad));
  const float forward = cosine - ideal_y * sine;
  const float left = -ideal_x;
  const float down = sine + ideal_y * cosine;
  const float level = std::sqrt(forward * forward + left * left);
  Ray ray{};
  ray.x = forward / level;
  ray.y = left / level;
  ray.slope = down / level;
  if (max_azimuth_ > 0.0F) {
    const float azimuth = std::atan2(left, forward);
    ray.sector = std::clamp(static_cast<int>((azimuth / max_azimuth_ + 1.0F) * 0.5F * kSectors), 0,
                            kSectors - 1);
  }
  return ray;
}

void Renderer::Impl::PrepareRays() {
  pixels_.resize(static_cast<std::size_t>(camera_.width * camera_.height));
  for (int v = 0; v < camera_.height; ++v) {
    for (int u = 0; u < camera_.width; ++u) {
      Pixel& pixel = pixels_[static_cast<std::size_t>(v * camera_.width + u)];
      const Eigen::Vector2d ideal = camera_.Undistorted({u, v});
      pixel.ideal_x = static_cast<float>((ideal.x() - camera_.cx) / camera_.fx);
      pixel.ideal_y = static_cast<float>((ideal.y() - camera_.cy) / camera_.fy);
      pixel.ray = RayThrough(pixel.ideal_x, pixel.ideal_y);
      max_azimuth_ =
          std::max(max_azimuth_, 1.001F * std::abs(std::atan2(pixel.ray.y, pixel.ray.x)));
    }
  }
  for (Pixel& pixel : pixels_) {
    pixel.ray = RayThrough(pixel.ideal_x, pixel.ideal_y);
    if (pixel.ray.slope <= 1e-4F) {
      pixel.ground_x = pixel.ground_y = kInfinity;
      continue;
    }
    const float range = height_ / pixel.ray.slope;
    pixel.ground_x = range * pixel.ray.x;
    pixel.ground_y = range * pixel.ray.y;
    const double across_m = std::hypot(range, height_) / camera_.fx;
    pixel.ground = FootprintFor(across_m, across_m * std::hypot(range, height_) / camera_.height_m,
                                floor_->texel_m(), floor_->levels());
  }
  for (int i = 0; i <= kSectors; ++i) {
    const double azimuth = static_cast<double>(max_azimuth_) * (2.0 * i / kSectors - 1.0);
    sector_edges_.emplace_back(static_cast<float>(std::cos(azimuth)),
                               static_cast<float>(std::sin(azimuth)));
  }
}

void Renderer::Impl::SortIntoSectors() {
  sectors_.assign(kSectors, {});
  sector_nearest_.assign(kSectors, kInfinity);
  const auto offer = [&](int sector, int solid, float range) {
    if (sector < 0 || sector >= kSectors) return;
    std::vector<Candidate>& list = sectors_[static_cast<std::size_t>(sector)];
    const float nearest =
        0.999F * range;  // between two edges of a sector it may bulge a little nearer
    if (!list.empty() && list.back().solid == solid) {
      list.back().nearest = std::min(list.back().nearest, nearest);
    } else {
      list.push_back({nearest, solid});
    }
  };
  const auto sector_of = [&](float x, float y) {
    const float azimuth = std::atan2(y, x);
    return static_cast<int>(std::floor((azimuth / max_azimuth_ + 1.0F) * 0.5F * kSectors));
  };
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    const int solid = static_cast<int>(i);
    // A convex footprint that reaches into a sector crosses one of its edges or has a corner in it.
    // Each sector's offers for one solid have to follow one another.
    std::array<float, kSectors + 1> edge_range;
    for (std::size_t k = 0; k < edge_range.size(); ++k) {
      float enter = 0.0F;
      float leave = 0.0F;
      int face = 0;
      edge_range[k] =
          CrossBody(body, sector_edges_[k].x(), sector_edges_[k].y(), enter, leave, face)
              ? enter
              : kInfinity;
    }
    for (std::size_t k = 0; k < kSectors; ++k) {
      const float range = std::min(edge_range[k], edge_range[k + 1]);
      if (range < kInfinity) offer(static_cast<int>(k), solid, range);
    }
    if (body.is_cylinder) {
      const float distance = std::hypot(body.centre_x, body.centre_y);
      offer(sector_of(body.centre_x, body.centre_y), solid, distance - body.radius);
    }
    for (std::size_t c = 0; c < static_cast<std::size_t>(body.corners); ++c) {
      if (body.corner_x[c] <= 0.0F) continue;
      offer(sector_of(body.corner_x[c], body.corner_y[c]), solid,
            std::hypot(body.corner_x[c], body.corner_y[c]));
    }
  }
  for (std::size_t k = 0; k < kSectors; ++k) {
    std::sort(sectors_[k].begin(), sectors_[k].end(),
              [](const Candidate& a, const Candidate& b) { return a.nearest < b.nearest; });
    if (!sectors_[k].empty()) sector_nearest_[k] = sectors_[k].front().nearest;
  }
}

Hit Renderer::Impl::Trace(const Ray& ray) const {
  Hit hit;
  hit.range = ray.slope > 1e-4F ? height_ / ray.slope : kInfinity;
  const auto sector = static_cast<std::size_t>(ray.sector);
  if (hit.range < sector_nearest_[sector]) return hit;
  for (const Candidate& candidate : sectors_[sector]) {
    if (candidate.nearest >= hit.range) break;
    const Body& body = bodies_[static_cast<std::size_t>(candidate.solid)];
    float enter = 0.0F;
    float leave = 0.0F;
    int face = 0;
    if (!CrossBody(body, ray.x, ray.y, enter, leave, face) || enter >= hit.range) continue;
    if (height_ - ray.slope * enter <= body.height) {
      hit = {enter, candidate.solid, face};
    } else if (height_ - ray.slope * leave < body.height) {
      const float range = (height_ - body.height) / ray.slope;
      if (range < hit.range) hit = {range, candidate.solid, kTopFace};
    }
  }
  return hit;
}

Colour Renderer::Impl::ShadeFloor(float x, float y, const Footprint& footprint, float along_x,
                                  float along_y) const {
  const float map_x = map_x_ + cosine_ * x - sine_ * y;
  const float map_y = map_y_ + sine_ * x + cosine_ * y;
  Colour colour =
      SampleFootprint(*floor_, footprint, map_x, map_y, cosine_ * along_x - sine_ * along_y,
                      sine_ * along_x + cosine_ * along_y);
  // What moves brings its shadow along; that of the rest is painted.
  for (std::size_t i = first_person_; i < bodies_.size(); ++i) {
    const float dx = x - bodies_[i].centre_x;
    const float dy = y - bodies_[i].centre_y;
    const float squared = dx * dx + dy * dy;
    if (squared < 0.25F) colour *= ContactShade(std::sqrt(squared) - bodies_[i].radius);
  }
  return colour;
}

Colour Renderer::Impl::ShadeSide(const Ray& ray, const Hit& hit) const {
  const auto solid = static_cast<std::size_t>(hit.solid);
  const Body& body = bodies_[solid];
  const Skin& skin = solid < first_person_ ? skins_[solid] : people_skins_[solid - first_person_];
  const float x = hit.range * ray.x;
  const float y = hit.range * ray.y;
  const float z = height_ - ray.slope * hit.range;
  const auto face = static_cast<std::size_t>(hit.face);
  float along = 0.0F;   // m from the face's first corner
  float cosine = 1.0F;  // between the ray and the face's normal, in the plane
  float sample = 0.0F;
  if (body.is_cylinder) {
    const float normal_x = (x - body.centre_x) / body.radius;
    const float normal_y = (y - body.centre_y) / body.radius;
    const auto turned = std::atan2(normal_y, normal_x) + static_cast<float>(map_from_robot_.theta);
    const float turns = turned / (2.0F * std::numbers::pi_v<float>);
    along = (turns - std::floor(turns)) * 2.0F * std::numbers::pi_v<float> * body.radius;
    sample = (turns - std::floor(turns)) * kRoundSamples;
    cosine = std::abs(normal_x * ray.x + normal_y * ray.y);
  } else {
    along = std::hypot(x - body.corner_x[face], y - body.corner_y[face]);
    sample = along / kLightStepM;
    cosine =
        std::abs(body.edge_x[face] * ray.y - body.edge_y[face] * ray.x) / body.edge_length[face];
  }
  const std::vector<float>& lights = skin.light[face];
  const auto first = std::min(static_cast<std::size_t>(sample), lights.size() - 1);
  const std::size_t second =
      body.is_cylinder ? (first + 1) % lights.size() : std::min(first + 1, lights.size() - 1);
  const float weight = std::clamp(sample - static_cast<float>(first), 0.0F, 1.0F);
  float light = (1.0F - weight) * lights[first] + weight * lights[second];
  if (!options_.one_look) light *= 1.0F - 0.3F * std::exp(-z / 0.04F);  // dark at the floor

  const float pixel_m = hit.range * std::hypot(1.0F, ray.slope) / static_cast<float>(camera_.fx);
  const auto textured = [&](int tile) {
    const MipImage& picture = tiles_[static_cast<std::size_t>(tile)];
    const Footprint footprint = FootprintFor(static_cast<double>(pixel_m),
                                             static_cast<double>(pixel_m / std::max(0.1F, cosine)),
                                             picture.texel_m(), picture.levels());
    return SampleFootprint(picture, footprint, along + skin.phase, z, 1.0F, 0.0F);
  };
  // How much of the pixel lies above a level line on the surface.
  const auto above = [&](float level) {
    return std::clamp((z - level) / pixel_m + 0.5F, 0.0F, 1.0F);
  };
  const auto stacked = [](const Colour& lower, const Colour& upper, float share) {
    return lower * (1.0F - share) + upper * share;
  };
  if (skin.is_person) {
    if (z < 0.5F)
      return stacked(textured(clothes_tile_), textured(clothes_tile_ + 1), above(kShoesM)) * light;
    return stacked(textured(clothes_tile_ + 1), textured(clothes_tile_ + 2), above(kWaistM)) *
           light;
  }
  if (skin.tile >= 0) return textured(skin.tile) * light;
  const float wall = has_skirting_ ? above(kSkirtingM) : 1.0F;
  if (wall <= 0.0F) return skirting_ * light;
  return stacked(skirting_, textured(skin.wall_tile[face][first]), wall) * light;
}

Colour Renderer::Impl::ShadeTop(const Ray& ray, const Hit& hit) const {
  const auto solid = static_cast<std::size_t>(hit.solid);
  const Skin& skin = solid < first_person_ ? skins_[solid] : people_skins_[solid - first_person_];
  const int tile = skin.tile >= 0 ? skin.tile : clothes_tile_ + 2;
  const MipImage& picture = tiles_[static_cast<std::size_t>(tile)];
  const float x = map_x_ + hit.range * (cosine_ * ray.x - sine_ * ray.y);
  const float y = map_y_ + hit.range * (sine_ * ray.x + cosine_ * ray.y);
  const double drop_m = std::max(0.02, static_cast<double>(height_ - bodies_[solid].height));
  const double distance_m = std::hypot(drop_m, static_cast<double>(hit.range));
  const double pixel_m = distance_m / camera_.fx;
  const Footprint footprint = FootprintFor(pixel_m, std::min(0.5, pixel_m * distance_m / drop_m),
                                           picture.texel_m(), picture.levels());
  return SampleFootprint(picture, footprint, x + skin.phase, y, cosine_ * ray.x - sine_ * ray.y,
                         sine_ * ray.x + cosine_ * ray.y);
}

Colour Renderer::Impl::Shade(const Ray& ray, const Hit& hit) const {
  return hit.face == kTopFace ? ShadeTop(ray, hit) : ShadeSide(ray, hit);
}

Colour Renderer::Impl::Supersample(const Pixel& pixel) const {
  // Eight rooks on a board: every column and row of the pixel is met once.
  static constexpr int kRooks[8] = {3, 6, 1, 4, 7, 2, 5, 0};
  Colour sum(0, 0, 0);
  for (int i = 0; i < 8; ++i) {
    const float du = (static_cast<float>(i) + 0.5F) / 8.0F - 0.5F;
    const float dv = (static_cast<float>(kRooks[i]) + 0.5F) / 8.0F - 0.5F;
    const Ray ray = RayThrough(pixel.ideal_x + du / static_cast<float>(camera_.fx),
                               pixel.ideal_y + dv / static_cast<float>(camera_.fy));
    const Hit hit = Trace(ray);
    sum += hit.solid < 0
               ? ShadeFloor(hit.range * ray.x, hit.range * ray.y, pixel.ground, ray.x, ray.y)
               : Shade(ray, hit);
  }
  return sum * 0.125F;
}

void Renderer::Impl::AddNoise(std::uint64_t frame, cv::Mat& image) const {
  const std::size_t bytes = static_cast<std::size_t>(image.cols) * 3;
  for (int row = 0; row < image.rows; ++row) {
    Random random(world_.seed, Stream::kCameraNoise,
                  frame * 4096 + static_cast<std::uint64_t>(row) + 1);
    const std::int8_t* noise = noise_.data() + random.Bits() % (noise_.size() - bytes);
    auto* pixel = image.ptr<std::uint8_t>(row);
    for (std::size_t i = 0; i < bytes; ++i) {
      const int value = pixel[i] + noise[i];
      pixel[i] = static_cast<std::uint8_t>(value < 0 ? 0 : value > 255 ? 255 : value);
    }
  }
}

cv::Mat Renderer::Impl::Render(const Pose2& map_from_robot, const std::vector<Solid>& people,
                               std::uint64_t frame, cv::Mat* labels) {
  map_from_robot_ = map_from_robot;
  cosine_ = static_cast<float>(std::cos(map_from_robot.theta));
  sine_ = static_cast<float>(std::sin(map_from_robot.theta));
  map_x_ = static_cast<float>(map_from_robot.x - world_.min.x());
  map_y_ = static_cast<float>(map_from_robot.y - world_.min.y());
  const Pose2 robot_from_map = map_from_robot.Inverse();
  bodies_.clear();
  people_skins_.clear();
  for (const Solid& solid : world_.solids)
    bodies_.push_back(BodyOf(Transformed(robot_from_map, solid)));
  first_person_ = bodies_.size();
  for (const Solid& person : people) {
    bodies_.push_back(BodyOf(Transformed(robot_from_map, person)));
    Skin skin;
    skin.is_person = true;
    for (int i = 0; i < kRoundSamples; ++i) skin.light[0].push_back(RoundLight(person, i));
    people_skins_.push_back(std::move(skin));
  }
  SortIntoSectors();

  std::vector<Hit> hits(pixels_.size());
  for (std::size_t i = 0; i < pixels_.size(); ++i) hits[i] = Trace(pixels_[i].ray);

  cv::Mat image(camera_.height, camera_.width, CV_8UC3);
  const auto width = static_cast<std::size_t>(camera_.width);
  for (int v = 0; v < camera_.height; ++v) {
    auto* out = image.ptr<cv::Vec3b>(v);
    for (int u = 0; u < camera_.width; ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u);
      const Pixel& pixel = pixels_[i];
      const std::uint16_t id = hits[i].Id();
      const bool is_edge = (u > 0 && hits[i - 1].Id() != id) ||
                           (u + 1 < camera_.width && hits[i + 1].Id() != id) ||
                           (v > 0 && hits[i - width].Id() != id) ||
                           (v + 1 < camera_.height && hits[i + width].Id() != id);
      const Colour colour = is_edge   ? Supersample(pixel)
                            : id == 0 ? ShadeFloor(pixel.ground_x, pixel.ground_y, pixel.ground,
                                                   pixel.ray.x, pixel.ray.y)
                                      : Shade(pixel.ray, hits[i]);
      for (int channel = 0; channel < 3; ++channel) {
        out[u][channel] = static_cast<std::uint8_t>(std::clamp(colour[channel], 0.0F, 255.0F));
      }
    }
  }
  AddNoise(frame, image);
  if (labels != nullptr) {
    labels->create(camera_.height, camera_.width, CV_8UC1);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      labels->data[i] = hits[i].solid < 0 ? kGround : kNotGround;
    }
  }
  return image;
}

Renderer::Renderer(const World& world, const GroundCamera& camera, const RenderOptions& options)
    : impl_(std::make_unique<Impl>(world, camera, options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

cv::Mat Renderer::Render(const Pose2& map_from_robot, const std::vector<Solid>& people,
                         std::uint64_t frame, cv::Mat* labels) {
  return impl_->Render(map_from_robot, people, frame, labels);
}

}  // namespace beckon::simulation
