// SPDX-License-Identifier: MIT
// Limits that several files of the contour tracker share.
#pragma once

namespace sdftrack {

inline constexpr int kLeastPixels = 30;   // an object of fewer has no colours to speak of
inline constexpr int kLeastRing_px = 12;  // of background around it
inline constexpr int kBlur = 2;           // cells, to each side

}  // namespace sdftrack
