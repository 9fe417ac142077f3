#include "perception/calibrate/board.hpp"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace breakshot::perception {
namespace {

constexpr double kInch = 0.0254;   // m
constexpr double kMargin = 0.010;  // m, of white around the chessboard
constexpr double kRuler = 0.100;   // m

std::string describe(const Board& board) {
  char text[120];
  std::snprintf(text, sizeof text, "ChArUco %d x %d, squares %.2f mm, markers %.2f mm. This line must be %.0f mm long:", board.columns,
                board.rows, 1e3 * board.square, 1e3 * board.marker, 1e3 * kRuler);
  return text;
}

/// One page of PDF 1.4 (ISO 32000-1): rectangles of ink, the caption and the ruler below them.
std::string to_pdf(const Board& board) {
  const double point = kInch / 72.0;
  const double width = (board.columns * board.square + 2.0 * kMargin) / point;
  const double height = (board.rows * board.square + 2.0 * kMargin) / point;
  std::ostringstream page;
  page.precision(9);
  for (const Ink& ink : ink_of(board)) {
    const Vector2 low = (ink.low + Vector2::Constant(kMargin)) / point, size = (ink.high - ink.low) / point;
    page << low.x() << ' ' << low.y() << ' ' << size.x() << ' ' << size.y() << " re f\n";
  }
  const double x = kMargin / point, y = 0.4 * kMargin / point;
  page << "BT /F 7 Tf " << x << ' ' << y << " Td (" << describe(board) << ") Tj ET\n";
  const double from = width - x - kRuler / point;
  page << "0.5 w " << from << ' ' << y << " m " << width - x << ' ' << y << " l S\n";

  std::ostringstream box;
  box.precision(9);
  box << "[0 0 " << width << ' ' << height << ']';
  const std::string objects[] = {
      "<< /Type /Catalog /Pages 2 0 R >>", "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      "<< /Type /Page /Parent 2 0 R /MediaBox " + box.str() + " /Contents 4 0 R /Resources << /Font << /F 5 0 R >> >> >>",
      "<< /Length " + std::to_string(page.str().size()) + " >>\nstream\n" + page.str() + "endstream",
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>"};
  std::string pdf = "%PDF-1.4\n", table = "0000000000 65535 f \n";
  int number = 0;
  for (const std::string& object : objects) {
    char entry[32];
    std::snprintf(entry, sizeof entry, "%010zu 00000 n \n", pdf.size());
    table += entry;
    pdf += std::to_string(++number) + " 0 obj\n" + object + "\nendobj\n";
  }
  const std::string count = std::to_string(number + 1);
  const std::string start = std::to_string(pdf.size());
  return pdf + "xref\n0 " + count + "\n" + table + "trailer\n<< /Size " + count + " /Root 1 0 R >>\nstartxref\n" + start + "\n%%EOF\n";
}

void write_png(const Board& board, const std::filesystem::path& file) {
  constexpr double kDot = kInch / 600.0;
  const auto dots = [&](double length) { return static_cast<int>(std::lround(length / kDot)); };
  const int width = dots(board.columns * board.square + 2.0 * kMargin), height = dots(board.rows * board.square + 2.0 * kMargin);
  cv::Mat1b image(height, width, std::uint8_t{255});
  for (const Ink& ink : ink_of(board)) {
    const cv::Point low{dots(ink.low.x() + kMargin), height - dots(ink.high.y() + kMargin)};
    const cv::Point high{dots(ink.high.x() + kMargin), height - dots(ink.low.y() + kMargin)};
    image(cv::Rect{low, high}) = std::uint8_t{0};
  }
  if (!cv::imwrite(file.string(), image)) throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace

void print_board(const Board& board, const std::filesystem::path& file) {
  if (file.extension() == ".png") return write_png(board, file);
  if (file.extension() != ".pdf") throw std::runtime_error(file.string() + ": found another ending; allowed: .pdf, .png");
  std::ofstream stream{file, std::ios::binary};
  stream << to_pdf(board);
  if (!stream.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace breakshot::perception
