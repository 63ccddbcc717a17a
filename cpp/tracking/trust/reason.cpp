// SPDX-License-Identifier: MIT
#include "tracking/trust/reason.h"

#include <array>
#include <string_view>

namespace sdftrack::tracking {

namespace {

struct Sentence {
  ReasonCode code;
  std::string_view text;  // {percent}, {number}, {name} and {text} stand for the arguments
};

constexpr std::array kSentences{
    Sentence{ReasonCode::kNone, ""},
    Sentence{ReasonCode::kNoDepthImage, "the frame has no depth image"},
    Sentence{ReasonCode::kUnreadable, "{text}"},
    Sentence{ReasonCode::kNoReading, "the depth image has no valid measurement"},
    Sentence{ReasonCode::kRepeatedDepth,
             "the depth image repeats the previous one; the pose is predicted from the last motion"},
    Sentence{ReasonCode::kRepeatedTime, "the timestamp equals that of the previous frame"},
    Sentence{ReasonCode::kBackwardTime, "the timestamp is earlier than that of the previous frame"},
    Sentence{ReasonCode::kTimeJump, "the timestamp jumps by more than ten times the usual interval"},
    Sentence{ReasonCode::kExposureJump,
             "the brightness of the colour image changes by more than a quarter from one frame to the next"},
    Sentence{ReasonCode::kFewReadings, "too few depth measurements near the last pose"},
    Sentence{ReasonCode::kBehindCamera,
             "the pose lies behind the camera (z = {text}); OpenCV's axes are expected: x right, y down, z "
             "forward (in OpenGL's, z < 0 is in front)"},
    Sentence{ReasonCode::kFarAway, "the pose lies {text}"},
    Sentence{ReasonCode::kOutsideImage, "the last pose lies outside the image"},
    Sentence{ReasonCode::kLittleVisible,
             "only {percent} % of the surface that should be visible is observed at this pose"},
    Sentence{ReasonCode::kHidden, "{percent} % of the object is occluded"},
    Sentence{ReasonCode::kSeenPast,
             "the camera observes free space at {percent} % of the surface that should be visible"},
    Sentence{ReasonCode::kWrongColors, "the observed colours do not match those of the object"},
    Sentence{ReasonCode::kRunsOn, "the observed surface continues where the object should end"},
    Sentence{ReasonCode::kMissingReadings,
             "most of the surface that should be visible has no depth measurement"},
    Sentence{ReasonCode::kPoorFit, "the depth measurements do not fit the shape well"},
    Sentence{ReasonCode::kOpenPosition,
             "the view shows hardly any edge, so the position is uncertain by more than the object's size"},
    Sentence{ReasonCode::kOpenDirections, "undetermined: {text}"},
    Sentence{ReasonCode::kOtherSize, "another size: {text}"},
    Sentence{ReasonCode::kOtherForm, "another shape: {text}"},
    Sentence{ReasonCode::kFreeScale, "the scale, which is free, is not determined by what has been seen"},
    Sentence{ReasonCode::kUnlikely, "the pose is right with a probability of only {percent} %"},
    Sentence{ReasonCode::kNotFinite,
             "the shape and the measurements give no finite pose and covariance; check the distances of the "
             "shape"},
    Sentence{ReasonCode::kByOutline,
             "no depth measurement: tracked by the outline in the colour image, which hardly constrains the "
             "distance"},
    Sentence{ReasonCode::kLittleOutline,
             "no depth measurement, and too little of the outline has enough contrast in the colour image"},
    Sentence{ReasonCode::kAmbiguous, "ambiguous: another pose explains the view nearly as well"},
    Sentence{ReasonCode::kNothingFound, "no match for the object was found"},
    Sentence{ReasonCode::kNoReadingInMask, "no depth measurement within the mask"},
    Sentence{ReasonCode::kFoundAgain, "found again; later frames must confirm it"},
    Sentence{ReasonCode::kNotConfirmed, "the object that was found was not confirmed"},
    Sentence{ReasonCode::kFoundStanding,
             "found among the objects on a plane; the next frame must confirm it"},
    Sentence{ReasonCode::kPrimitiveNotFound,
             "no {text} found there; give a mask of it, or a frame in which it stands alone on the table"},
    Sentence{ReasonCode::kSamePlace,
             "the pose coincides with that of another tracked object: object {number}"},
    Sentence{ReasonCode::kOverlaps, "the pose coincides with that of another tracked object: {name}"},
    Sentence{ReasonCode::kPlacedByNeighbors,
             "occluded: the pose is inferred from neighbouring objects and the motion"},
    Sentence{ReasonCode::kMaybeExchanged, "it may have been swapped with object {number}"},
    Sentence{
        ReasonCode::kBeyondMask,
        "the observed shape extends {percent} % beyond the first mask: something else was fused into it, "
        "or the mask shows only a part of the object; start with a complete mask, and "
        "keep_to_mask=True"},
};

constexpr bool in_order_of_codes() {
  for (std::size_t i = 0; i < kSentences.size(); ++i)
    if (std::size_t(kSentences[i].code) != i) return false;
  return kSentences.size() == std::size_t(ReasonCode::kCount);
}
static_assert(in_order_of_codes(), "one sentence for each code");

void replace(std::string_view key, const std::string& value, std::string* text) {
  const std::size_t at = text->find(key);
  if (at != std::string::npos) text->replace(at, key.size(), value);
}

}  // namespace

std::string sentence(const Reason& reason, const std::vector<std::string>& names) {
  std::string out{kSentences.at(std::size_t(reason.code)).text};
  const std::string number = std::to_string(reason.object);
  const bool named = reason.object >= 0 && std::size_t(reason.object) < names.size();
  replace("{percent}", std::to_string(reason.percent), &out);
  replace("{number}", number, &out);
  replace("{name}", named ? names[reason.object] : "object " + number, &out);
  replace("{text}", reason.text, &out);
  if (reason.frame != ReasonCode::kNone) out += "; " + sentence({reason.frame});
  if (!reason.more.empty()) out += "; " + reason.more;
  return out;
}

}  // namespace sdftrack::tracking
