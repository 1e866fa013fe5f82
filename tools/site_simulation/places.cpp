#include "tools/site_simulation/places.hpp"

#include <cmath>
#include <stdexcept>

namespace beckon {
namespace {

constexpr double kBeaconHeightM = 2.0;

void AddBeacons(Site& site, const std::vector<Eigen::Vector2d>& positions) {
  for (const Eigen::Vector2d& at : positions) {
    const std::string id = "B" + std::to_string(site.beacons.size() + 1);
    site.beacons.push_back({id, {at.x(), at.y(), kBeaconHeightM}});
  }
}

// Columns x rows places, spread evenly over a rectangle, clear of its border.
void AddPoints(const Eigen::Vector2d& min, const Eigen::Vector2d& max, int columns, int rows,
               std::vector<Eigen::Vector2d>& points) {
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Array2d share((column + 0.5) / columns, (row + 0.5) / rows);
      points.emplace_back(min.array() + share * (max - min).array());
    }
  }
}

// To and fro along x, in lanes at most `lane_m` apart.
void AddLanes(const Eigen::Vector2d& min, const Eigen::Vector2d& max, double lane_m,
              std::vector<Eigen::Vector2d>& walk) {
  constexpr double kClearM = 0.4;
  const double extent = max.y() - min.y() - 2.0 * kClearM;
  const int lanes = static_cast<int>(std::ceil(extent / lane_m)) + 1;
  for (int lane = 0; lane < lanes; ++lane) {
    const double y = min.y() + kClearM + extent * lane / (lanes - 1);
    const double left = min.x() + kClearM;
    const double right = max.x() - kClearM;
    walk.emplace_back(lane % 2 == 0 ? left : right, y);
    walk.emplace_back(lane % 2 == 0 ? right : left, y);
  }
}

// A room of 6 x 6 m and a corridor of 6.5 x 2 m, with a door between them: 49 m2.
Place RoomAndCorridor() {
  Place place;
  Site& site = place.site;
  site.plan.max = {6.5, 8.0};
  site.plan.outline = {{0.0, 0.0}, {6.5, 0.0}, {6.5, 2.0}, {6.0, 2.0}, {6.0, 8.0}, {0.0, 8.0}};
  site.plan.walls = {{{0.0, 2.0}, {2.5, 2.0}, std::nullopt},
                     {{3.5, 2.0}, {6.0, 2.0}, std::nullopt}};
  AddBeacons(site, {{0.1, 0.1},
                    {6.4, 0.1},
                    {0.1, 2.1},
                    {5.9, 2.1},
                    {0.1, 7.9},
                    {5.9, 7.9},
                    {3.0, 7.9},
                    {3.0, 0.1}});
  AddPoints({0.0, 2.0}, {6.0, 8.0}, 4, 5, place.points);
  AddPoints({0.0, 0.0}, {6.5, 2.0}, 3, 2, place.points);
  AddLanes({0.0, 0.0}, {6.5, 2.0}, 1.0, place.walk);
  place.walk.emplace_back(3.0, 1.6);
  place.walk.emplace_back(3.0, 2.4);
  AddLanes({0.0, 2.0}, {6.0, 8.0}, 1.0, place.walk);
  place.radio.shadowing_sd_db = 12.0;
  return place;
}

// 15 x 2 m.
Place Corridor() {
  Place place;
  place.site.plan.max = {15.0, 2.0};
  AddBeacons(place.site,
             {{0.5, 0.1}, {3.3, 1.9}, {6.1, 0.1}, {8.9, 1.9}, {11.7, 0.1}, {14.5, 1.9}});
  AddPoints({0.0, 0.0}, {15.0, 2.0}, 7, 3, place.points);
  AddLanes({0.0, 0.0}, {15.0, 2.0}, 1.0, place.walk);
  place.radio.shadowing_sd_db = 8.0;
  return place;
}

// 40 x 15 m.
Place Hallway() {
  Place place;
  place.site.plan.max = {40.0, 15.0};
  AddBeacons(place.site, {{0.5, 0.5},
                          {13.5, 0.5},
                          {26.5, 0.5},
                          {39.5, 0.5},
                          {0.5, 14.5},
                          {13.5, 14.5},
                          {26.5, 14.5},
                          {39.5, 14.5}});
  AddPoints({0.0, 0.0}, {40.0, 15.0}, 10, 6, place.points);
  AddLanes({0.0, 0.0}, {40.0, 15.0}, 1.5, place.walk);
  place.radio.shadowing_sd_db = 2.6;
  return place;
}

}  // namespace

Place ThesisPlace(const std::string& name) {
  Place place;
  if (name == "EE1") {
    place = RoomAndCorridor();
  } else if (name == "EE2") {
    place = Corridor();
  } else if (name == "EE3") {
    place = Hallway();
  } else {
    throw std::invalid_argument("the places are EE1, EE2 and EE3, not '" + name + "'");
  }
  place.site.name = name;
  place.site.tag_height_m = 1.0;
  place.site.window_s = 2.0;
  return place;
}

}  // namespace beckon
