#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace breakshot::sim_bridge {

/// How many pixels an image has.
constexpr std::size_t area(int width, int height) { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
/// Where a pixel is in an image that is stored row by row.
constexpr std::size_t pixel_index(int x, int y, int width) { return area(width, y) + static_cast<std::size_t>(x); }

/// A part of the image, px.
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;
};

/// Which parts of an image something is drawn into: the image in square tiles, each marked or not.
///
/// Everything that a frame costs in GL is proportional to the marked area; the rest of the image is the background, rendered once.
class TileGrid {
 public:
  /// px. Divides the 64 of llvmpipe's bins. A disc of the cell touches 10 tiles of this size, 10000 px for the 4000 that it covers; with 64 it
  /// would be 18000.
  static constexpr int kTile = 32;

  TileGrid(int width, int height)
      : width_{width},
        height_{height},
        columns_{(width + kTile - 1) / kTile},
        rows_{(height + kTile - 1) / kTile},
        marked_(area(columns_, rows_), 0) {}

  void clear() { std::fill(marked_.begin(), marked_.end(), std::uint8_t{0}); }
  void mark_all() { std::fill(marked_.begin(), marked_.end(), std::uint8_t{1}); }

  /// Marks every tile that a rectangle of pixel coordinates touches, with one pixel of margin. Parts outside the image are ignored.
  void mark(double u_min, double v_min, double u_max, double v_max) {
    const int left = tile_of(u_min - 1.0, columns_), right = tile_of(u_max + 1.0, columns_);
    const int top = tile_of(v_min - 1.0, rows_), bottom = tile_of(v_max + 1.0, rows_);
    for (int row = std::max(top, 0); row <= std::min(bottom, rows_ - 1); ++row) {
      for (int column = std::max(left, 0); column <= std::min(right, columns_ - 1); ++column) marked_[index(column, row)] = 1;
    }
  }

  /// Marks the tile that begins where the rectangle does.
  void mark_tile(const PixelRect& tile) { marked_[index(tile.x / kTile, tile.y / kTile)] = 1; }

  void mark(const TileGrid& other) {
    for (std::size_t i = 0; i < marked_.size(); ++i) marked_[i] |= other.marked_[i];
  }

  void unmark(const TileGrid& other) {
    for (std::size_t i = 0; i < marked_.size(); ++i) marked_[i] = static_cast<std::uint8_t>(marked_[i] & ~other.marked_[i]);
  }

  /// Leaves only what is marked there, too.
  void keep(const TileGrid& other) {
    for (std::size_t i = 0; i < marked_.size(); ++i) marked_[i] &= other.marked_[i];
  }

  bool meets(const TileGrid& other) const {
    for (std::size_t i = 0; i < marked_.size(); ++i) {
      if ((marked_[i] & other.marked_[i]) != 0) return true;
    }
    return false;
  }

  bool empty() const {
    return std::none_of(marked_.begin(), marked_.end(), [](std::uint8_t tile) { return tile != 0; });
  }

  /// Calls visit(PixelRect) for each marked tile.
  template <typename Visit>
  void for_each_tile(Visit&& visit) const {
    for_each_run([&](const PixelRect& run) {
      for (int x = run.x; x < run.x + run.width; x += kTile) visit(PixelRect{x, run.y, std::min(kTile, run.x + run.width - x), run.height});
    });
  }

  /// Calls visit(PixelRect) for each maximal horizontal run of tiles that are marked here and, when `except` is given, not there.
  template <typename Visit>
  void for_each_run(Visit&& visit, const TileGrid* except = nullptr) const {
    const auto wanted = [&](int column, int row) {
      return marked_[index(column, row)] != 0 && (except == nullptr || except->marked_[index(column, row)] == 0);
    };
    for (int row = 0; row < rows_; ++row) {
      for (int begin = 0; begin < columns_; ++begin) {
        if (!wanted(begin, row)) continue;
        int end = begin + 1;
        while (end < columns_ && wanted(end, row)) ++end;
        visit(PixelRect{begin * kTile, row * kTile, std::min(end * kTile, width_) - begin * kTile,
                        std::min((row + 1) * kTile, height_) - row * kTile});
        begin = end;
      }
    }
  }

 private:
  std::size_t index(int column, int row) const { return pixel_index(column, row, columns_); }
  /// Clamped before the conversion, so that far-away coordinates do not overflow; one beyond the grid on either side means outside.
  static int tile_of(double coordinate, int count) {
    return static_cast<int>(std::clamp(std::floor((coordinate + 0.5) / kTile), -1.0, static_cast<double>(count)));
  }

  int width_, height_, columns_, rows_;
  std::vector<std::uint8_t> marked_;
};

}  // namespace breakshot::sim_bridge
