#pragma once

#include "perception/disc_fit.hpp"
#include "perception/settings.hpp"
#include "perception/table_light.hpp"
#include "perception/view.hpp"

#include <opencv2/core.hpp>

#include <span>

namespace breakshot::perception {

/// Whether the discs' hues fit the paints clearly better with red and blue exchanged, as from a camera or a file whose channels are in
/// another order than is believed.
///
/// A palette that is even around the circle of hues fits its own mirror image to a dozen degrees, which the ranges of colours forgive; and a grey
/// table says nothing. Needs three discs of two colours whose paints are known; says no with fewer.
bool mirrored_hues(const cv::Mat3b& rgb, const TableLight& light, std::span<const ColourRange> colours, const View& view,
                   std::span<const DiscFit> discs);

}  // namespace breakshot::perception
