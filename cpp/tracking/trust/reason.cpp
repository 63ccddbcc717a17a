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
    Sentence{ReasonCode::kNoReading, "the depth image has no valid reading"},
    Sentence{ReasonCode::kRepeatedDepth,
             "the depth image is that of the frame before; the pose is moved on by the last motion"},
    Sentence{ReasonCode::kRepeatedTime, "the timestamp is that of the frame before"},
    Sentence{ReasonCode::kBackwardTime, "the timestamp lies before that of the last frame"},
    Sentence{ReasonCode::kTimeJump, "the timestamp jumps by more than ten usual steps"},
    Sentence{ReasonCode::kExposureJump,
             "the brightness of the colour image changes by more than a quarter in one frame"},
    Sentence{ReasonCode::kFewReadings, "too few depth readings near the last pose"},
    Sentence{ReasonCode::kLittleVisible,
             "only {percent} % of the surface that the camera should see is where the pose puts it"},
    Sentence{ReasonCode::kHidden, "{percent} % of the object is hidden"},
    Sentence{ReasonCode::kSeenPast, "the camera sees past {percent} % of the surface that it should see"},
    Sentence{ReasonCode::kWrongColors, "the colours are not those of the object"},
    Sentence{ReasonCode::kRunsOn, "the surface goes on where the object should end"},
    Sentence{ReasonCode::kMissingReadings, "most of the surface that the camera should see has no reading"},
    Sentence{ReasonCode::kPoorFit, "the readings do not fit the shape well"},
    Sentence{ReasonCode::kOpenPosition,
             "the view hardly shows an edge and leaves the position open by more than the object's size"},
    Sentence{
        ReasonCode::kByOutline,
        "no depth reading: followed by its outline in the colour image, which hardly shows the distance"},
    Sentence{ReasonCode::kLittleOutline,
             "no depth reading, and too little of its outline stands out in the colour image"},
    Sentence{ReasonCode::kAmbiguous, "ambiguous: another pose explains the view nearly as well"},
    Sentence{ReasonCode::kNothingFound, "nothing was found that could be the object"},
    Sentence{ReasonCode::kNoReadingInMask, "no depth reading within the mask"},
    Sentence{ReasonCode::kFoundAgain, "found again; the next frame must confirm it"},
    Sentence{ReasonCode::kNotConfirmed, "what seemed to be the object was not confirmed"},
    Sentence{ReasonCode::kPrimitiveNotFound,
             "no {text} found there; give a mask of it, or a frame in which it stands free on the table"},
    Sentence{ReasonCode::kSamePlace, "it stands where another is tracked: object {number}"},
    Sentence{ReasonCode::kOverlaps, "it stands where another is tracked: {name}"},
    Sentence{ReasonCode::kPlacedByNeighbors, "hidden: placed by its neighbours and its motion"},
    Sentence{ReasonCode::kMaybeExchanged, "it may have changed places with object {number}"},
};

constexpr bool in_order_of_codes() {
  for (std::size_t i = 0; i < kSentences.size(); ++i)
    if (static_cast<std::size_t>(kSentences[i].code) != i) return false;
  return kSentences.size() == static_cast<std::size_t>(ReasonCode::kCount);
}
static_assert(in_order_of_codes(), "one sentence for each code");

void replace(std::string_view key, const std::string& value, std::string* text) {
  const std::size_t at = text->find(key);
  if (at != std::string::npos) text->replace(at, key.size(), value);
}

}  // namespace

std::string sentence(const Reason& reason, const std::vector<std::string>& names) {
  std::string out{kSentences.at(static_cast<std::size_t>(reason.code)).text};
  const std::string number = std::to_string(reason.object);
  const bool named = reason.object >= 0 && static_cast<std::size_t>(reason.object) < names.size();
  replace("{percent}", std::to_string(reason.percent), &out);
  replace("{number}", number, &out);
  replace("{name}", named ? names[static_cast<std::size_t>(reason.object)] : "object " + number, &out);
  replace("{text}", reason.text, &out);
  if (reason.frame != ReasonCode::kNone) out += "; " + sentence({reason.frame});
  return out;
}

}  // namespace sdftrack::tracking
