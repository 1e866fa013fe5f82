#include "tools/simulation/floor_picture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace beckon::simulation {
namespace {

struct PaintedDecal {
  Pose2 decal_from_map;
  Eigen::Vector2d half_size;
  Decal::Kind kind;
  Look look;
  Room room;
};

std::size_t RoomAt(const World& world, const Eigen::Vector2d& point) {
  std::size_t nearest = 0;
  double nearest_m = 1e9;
  for (std::size_t i = 0; i < world.rooms.size(); ++i) {
    const Room& room = world.rooms[i];
    const double distance_m = (room.min - point).cwiseMax(point - room.max).cwiseMax(0.0).norm();
    if (distance_m < nearest_m) {
      nearest = i;
      nearest_m = distance_m;
    }
  }
  return nearest;
}

std::vector<PaintedDecal> PrepareDecals(const World& world, const std::vector<Look>& floors,
                                        Random& random) {
  std::vector<PaintedDecal> decals;
  for (const Decal& decal : world.decals) {
    const std::size_t room = RoomAt(world, decal.map_from_decal.translation());
    Look look = RandomFurnitureLook(random, floors[room].first);
    look.kind = random.Chance(0.4) ? LookKind::kStripes : LookKind::kFabric;
    decals.push_back(
        {decal.map_from_decal.Inverse(), 0.5 * decal.size, decal.kind, look, world.rooms[room]});
  }
  return decals;
}

// Lines of print on white.
Colour PaperColour(const Eigen::Vector2d& place, const Eigen::Vector2d& half_size) {
  const bool in_text = (place.cwiseAbs().array() < half_size.array() - 0.025).all();
  const bool in_line = std::fmod(place.y() + 1.0, 0.009) < 0.004;
  const bool word_gap =
      std::fmod(3.0 * place.x() + 17.0 * std::floor((place.y() + 1.0) / 0.009), 0.13) < 0.03;
  return in_text && in_line && !word_gap ? Colour(120, 120, 120) : Colour(238, 240, 240);
}

// Lays the decal over the floor's colour at a point, its edge softened to a texel.
void LayDecal(const PaintedDecal& decal, const Eigen::Vector2d& point, double texel_m,
              Colour& colour) {
  const Eigen::Vector2d place = decal.decal_from_map * point;
  const double inside_m = (decal.half_size - place.cwiseAbs()).minCoeff();
  const double cover = std::clamp(inside_m / texel_m + 0.5, 0.0, 1.0);
  if (cover <= 0.0 || !decal.room.Contains(point)) return;
  Colour own;
  if (decal.kind == Decal::Kind::kPaper) {
    own = PaperColour(place, decal.half_size);
  } else {
    own = Albedo(decal.look, static_cast<float>(place.x()), static_cast<float>(place.y()), false);
    if (inside_m < 0.06) own *= 0.7F;  // hem
  }
  colour = colour * static_cast<float>(1.0 - cover) + own * static_cast<float>(cover);
}

}  // namespace

MipImage PaintFloor(const World& world, const std::vector<Look>& floors, const Lighting& lighting,
                    double texel_m, Random& random) {
  const cv::Mat light = lighting.OnFloor(world);
  const std::vector<PaintedDecal> decals = PrepareDecals(world, floors, random);
  // Sides that can be halved six times.
  const auto side = [&](double length_m) {
    return 64 * static_cast<int>(std::ceil(length_m / texel_m / 64.0));
  };
  const Eigen::Vector2d size = world.max - world.min;
  cv::Mat picture(side(size.y()), side(size.x()), CV_8UC4);

  cv::Mat room_at(light.size(), CV_8UC1);
  for (int row = 0; row < light.rows; ++row) {
    for (int column = 0; column < light.cols; ++column) {
      const Eigen::Vector2d point =
          world.min + Lighting::kCellM * Eigen::Vector2d(column + 0.5, row + 0.5);
      room_at.at<std::uint8_t>(row, column) = static_cast<std::uint8_t>(RoomAt(world, point));
    }
  }

  cv::parallel_for_(cv::Range(0, picture.rows), [&](const cv::Range& rows) {
    for (int row = rows.start; row < rows.end; ++row) {
      const double y = (row + 0.5) * texel_m;
      const double light_row = std::clamp(y / Lighting::kCellM - 0.5, 0.0, light.rows - 1.001);
      const int j = static_cast<int>(light_row);
      const auto b = static_cast<float>(light_row - j);
      std::vector<const PaintedDecal*> near;
      for (const PaintedDecal& decal : decals) {
        const double decal_y = decal.decal_from_map.Inverse().y;
        if (std::abs(decal_y - world.min.y() - y) < decal.half_size.norm()) near.push_back(&decal);
      }
      for (int column = 0; column < picture.cols; ++column) {
        const double x = (column + 0.5) * texel_m;
        const double light_column = std::clamp(x / Lighting::kCellM - 0.5, 0.0, light.cols - 1.001);
        const int i = static_cast<int>(light_column);
        const auto a = static_cast<float>(light_column - i);
        const Look& floor = floors[room_at.at<std::uint8_t>(
            std::min(light.rows - 1, static_cast<int>(y / Lighting::kCellM)),
            std::min(light.cols - 1, static_cast<int>(x / Lighting::kCellM)))];
        Colour colour = Albedo(floor, static_cast<float>(x), static_cast<float>(y), false);
        for (const PaintedDecal* decal : near) {
          LayDecal(*decal, world.min + Eigen::Vector2d(x, y), texel_m, colour);
        }
        const float lit =
            (1.0F - b) * ((1.0F - a) * light.at<float>(j, i) + a * light.at<float>(j, i + 1)) +
            b * ((1.0F - a) * light.at<float>(j + 1, i) + a * light.at<float>(j + 1, i + 1));
        colour *= lit;
        picture.at<cv::Vec4b>(row, column) = {cv::saturate_cast<std::uint8_t>(colour[0]),
                                              cv::saturate_cast<std::uint8_t>(colour[1]),
                                              cv::saturate_cast<std::uint8_t>(colour[2]), 0};
      }
    }
  });
  return MipImage(picture, texel_m, false);
}

}  // namespace beckon::simulation
