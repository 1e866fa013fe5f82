#include "services/rssi_localizer/floor_grid.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace beckon {
namespace {

bool WallBetween(const FloorPlan& plan, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  for (const Wall& wall : plan.walls) {
    if (SegmentsMeet(a, b, wall.from, wall.to)) return true;
  }
  return false;
}

}  // namespace

FloorGrid::FloorGrid(const FloorPlan& plan, const FloorGridOptions& options,
                     const std::vector<Eigen::Vector2d>& known_free) {
  double resolution_m = options.resolution_m;
  const Eigen::Vector2d extent = plan.max - plan.min;
  while (extent.prod() / (resolution_m * resolution_m) > options.max_cells) resolution_m *= 2.0;
  geometry_ = GridGeometry::Covering(plan.min, plan.max, resolution_m);

  cv::Mat mask = plan.FreeMask(geometry_);
  for (const Eigen::Vector2d& point : known_free) {
    const int index = geometry_.IndexAt(point);
    if (index >= 0) mask.at<uchar>(index / geometry_.width, index % geometry_.width) = 255;
  }

  cell_at_.assign(static_cast<std::size_t>(geometry_.size()), -1);
  const cv::Rect whole(0, 0, geometry_.width, geometry_.height);
  for (int top = 0; top < geometry_.height; top += kBlockSide) {
    for (int left = 0; left < geometry_.width; left += kBlockSide) {
      const cv::Rect block = cv::Rect(left, top, kBlockSide, kBlockSide) & whole;
      for (int row = block.y; row < block.br().y; ++row) {
        for (int column = block.x; column < block.br().x; ++column) {
          if (mask.at<uchar>(row, column) == 0) continue;
          const int index = geometry_.Index(column, row);
          cell_at_[static_cast<std::size_t>(index)] = size();
          geometry_index_.push_back(index);
          centres_.push_back(geometry_.Centre(index));
        }
      }
    }
  }
  if (centres_.empty()) {
    throw std::invalid_argument("the floor plan leaves no free cell of " +
                                std::to_string(resolution_m) + " m");
  }

  constexpr std::array<std::array<int, 2>, 4> kSteps = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  neighbours_.resize(centres_.size());
  for (std::size_t cell = 0; cell < centres_.size(); ++cell) {
    const int column = geometry_index_[cell] % geometry_.width;
    const int row = geometry_index_[cell] / geometry_.width;
    for (std::size_t k = 0; k < kSteps.size(); ++k) {
      const int to_column = column + kSteps[k][0];
      const int to_row = row + kSteps[k][1];
      neighbours_[cell][k] = -1;
      if (!geometry_.Contains(to_column, to_row)) continue;
      const int to = cell_at_[static_cast<std::size_t>(geometry_.Index(to_column, to_row))];
      if (to < 0 || WallBetween(plan, centres_[cell], geometry_.Centre(to_column, to_row)))
        continue;
      neighbours_[cell][k] = to;
    }
  }
  MakeBlocks();
  moments_.origin = 0.5 * (plan.min + plan.max);
  for (const Eigen::Vector2d& centre : centres_) {
    moments_.first += centre - moments_.origin;
    moments_.second += (centre - moments_.origin) * (centre - moments_.origin).transpose();
  }
}

void FloorGrid::MakeBlocks() {
  const auto across = [](int extent) { return (extent + kBlockSide - 1) / kBlockSide; };
  const int columns = across(geometry_.width);
  const int rows = across(geometry_.height);
  std::vector<int> block_at(static_cast<std::size_t>(columns * rows), -1);
  std::vector<int> at;  // per block
  for (int cell = 0; cell < size(); ++cell) {
    const int index = geometry_index_[static_cast<std::size_t>(cell)];
    const int square =
        index / geometry_.width / kBlockSide * columns + index % geometry_.width / kBlockSide;
    int& block = block_at[static_cast<std::size_t>(square)];
    if (block < 0) {
      block = static_cast<int>(blocks_.size());
      blocks_.emplace_back();
      at.push_back(square);
    }
    std::vector<int>& cells = blocks_[static_cast<std::size_t>(block)].cells;
    block_of_.emplace_back(block, static_cast<int>(cells.size()));
    cells.push_back(cell);
  }
  for (std::size_t block = 0; block < blocks_.size(); ++block) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const int cell : blocks_[block].cells) middle += centres_[static_cast<std::size_t>(cell)];
    middle /= static_cast<double>(blocks_[block].cells.size());
    const auto off = [&](int cell) {
      return (centres_[static_cast<std::size_t>(cell)] - middle).squaredNorm();
    };
    blocks_[block].representative =
        *std::min_element(blocks_[block].cells.begin(), blocks_[block].cells.end(),
                          [&](int a, int b) { return off(a) < off(b); });
    const int column = at[block] % columns;
    const int row = at[block] / columns;
    for (int r = std::max(0, row - 1); r <= std::min(rows - 1, row + 1); ++r) {
      for (int c = std::max(0, column - 1); c <= std::min(columns - 1, column + 1); ++c) {
        const int other = block_at[static_cast<std::size_t>(r * columns + c)];
        if (other >= 0 && other != static_cast<int>(block)) {
          blocks_[block].neighbours.push_back(other);
        }
      }
    }
  }
}

int FloorGrid::NearestCell(const Eigen::Vector2d& point) const {
  const int index = geometry_.IndexAt(point);
  if (index >= 0 && cell_at_[static_cast<std::size_t>(index)] >= 0) {
    return cell_at_[static_cast<std::size_t>(index)];
  }
  int nearest = 0;
  double nearest_squared = std::numeric_limits<double>::infinity();
  for (int cell = 0; cell < size(); ++cell) {
    const double squared = (centres_[static_cast<std::size_t>(cell)] - point).squaredNorm();
    if (squared < nearest_squared) {
      nearest_squared = squared;
      nearest = cell;
    }
  }
  return nearest;
}

}  // namespace beckon
