#include "perception/image_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include <string>
#include <vector>

namespace breakshot::perception {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

cv::Mat3b colours() {
  cv::Mat3b bgr(40, 60);
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) bgr(y, x) = {static_cast<std::uint8_t>(4 * x), static_cast<std::uint8_t>(6 * y), 200};
  }
  return bgr;
}

Bytes encoded(const cv::Mat& image, const std::string& kind) {
  Bytes bytes;
  cv::imencode(kind, image, bytes);
  return bytes;
}

std::string error_of(const Bytes& bytes, bool depth = false) {
  try {
    depth ? (void)decode_depth(bytes, "x") : (void)decode_color(bytes, "x");
  } catch (const ImageFileError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ImageFile, ReadsPngAndJpeg) {
  const ColorFrame png = decode_color(encoded(colours(), ".png"), "x");
  ASSERT_EQ(png.width, 60);
  ASSERT_EQ(png.height, 40);
  ASSERT_EQ(png.rgb.size(), 3U * 60 * 40);
  EXPECT_EQ(png.rgb[0], 200);  // red comes first
  EXPECT_EQ(png.rgb[3 * 59 + 2], 236);
  const ColorFrame jpeg = decode_color(encoded(colours(), ".jpg"), "x");
  EXPECT_EQ(jpeg.width, 60);
  EXPECT_NEAR(jpeg.rgb[0], 200, 12);
  Bytes padded = encoded(colours(), ".jpg");
  padded.resize(padded.size() + 16);
  EXPECT_EQ(decode_color(padded, "x").rgb, jpeg.rgb);

  cv::Mat1w depth(3, 5, std::uint16_t{8000});
  depth(2, 1) = 7995;
  const DepthFrame frame = decode_depth(encoded(depth, ".png"), "x");
  EXPECT_EQ(frame.width, 5);
  EXPECT_EQ(frame.depth[11], 7995);
}

TEST(ImageFile, RefusesWhatIsNoSuchPicture) {
  EXPECT_THAT(error_of({}), HasSubstr("x: found an empty file; allowed: PNG, JPEG"));
  EXPECT_THAT(error_of({'n', 'o'}), HasSubstr("found no image of a known kind"));
  EXPECT_THAT(error_of(encoded(colours(), ".bmp")), HasSubstr("found no image of a known kind"));
  EXPECT_THAT(error_of(encoded(cv::Mat1b(9, 9, std::uint8_t{1}), ".png")),
              HasSubstr("found 1 channel of 8 bits; allowed: 3 channels of 8 bits"));
  EXPECT_THAT(error_of(encoded(cv::Mat(9, 9, CV_16UC3, cv::Scalar::all(1)), ".png")), HasSubstr("found 3 channels of 16 bits"));
  EXPECT_THAT(error_of(encoded(cv::Mat(9, 9, CV_8UC4, cv::Scalar::all(1)), ".png")), HasSubstr("found 4 channels of 8 bits"));
  EXPECT_THAT(error_of(encoded(colours(), ".png"), true), HasSubstr("found 3 channels of 8 bits; allowed: 1 channel of 16 bits"));
}

TEST(ImageFile, RefusesEveryTruncation) {
  for (const std::string kind : {".png", ".jpg"}) {
    const Bytes whole = encoded(colours(), kind);
    for (std::size_t size = 0; size < whole.size(); size += 7) {
      EXPECT_NE(error_of(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size))), "no error") << kind << " " << size;
    }
  }
}

TEST(ImageFile, RefusesSizesBeforeMemoryIsAskedFor) {
  Bytes png = encoded(colours(), ".png");
  png[16] = 0x7f;  // width 2130706492
  EXPECT_THAT(error_of(png), HasSubstr("found 2130706492 x 40 px; allowed: 1 to 4096 px a side"));
  Bytes jpeg = encoded(colours(), ".jpg");
  for (std::size_t i = 0; i + 8 < jpeg.size(); ++i) {
    if (jpeg[i] == 0xff && jpeg[i + 1] == 0xc0) {
      jpeg[i + 5] = 0xff;  // height 65320
      break;
    }
  }
  EXPECT_THAT(error_of(jpeg), HasSubstr("px; allowed: 1 to 4096 px a side"));
}

TEST(ImageFile, SaysWhichFileCannotBeReadOrWritten) {
  EXPECT_THROW((void)read_color("/no/such/picture.png"), ImageFileError);
  EXPECT_THROW((void)read_color("/"), ImageFileError);
  const ColorFrame frame = decode_color(encoded(colours(), ".png"), "x");
  EXPECT_THROW(write_color("/no/such/folder/picture.png", frame), ImageFileError);
  EXPECT_THROW(write_color(testing::TempDir() + "/picture.unknown", frame), ImageFileError);
}

}  // namespace
}  // namespace breakshot::perception
