// SPDX-License-Identifier: MIT
// How far a pose may be trusted, and why: codes for decisions, and sentences for people.
#pragma once

#include <string>
#include <vector>

namespace sdftrack::tracking {

enum class Status { kOk, kWeak, kLost, kBadFrame };

enum class ReasonCode {
  kNone,
  // The frame
  kNoDepthImage,
  kUnreadable,  // text: the error of the frame's reader
  kNoReading,
  kRepeatedDepth,
  kRepeatedTime,
  kBackwardTime,
  kTimeJump,
  kExposureJump,
  // The evidence about a pose
  kFewReadings,
  kBehindCamera,  // text: its z
  kFarAway,       // text: how far
  kOutsideImage,
  kLittleVisible,  // percent
  kHidden,         // percent
  kSeenPast,       // percent
  kWrongColors,
  kRunsOn,
  kMissingReadings,
  kPoorFit,
  kOpenPosition,
  kOpenDirections,  // text: which
  kOtherSize,       // text
  kOtherForm,       // text
  kFreeScale,
  kUnlikely,  // percent
  kNotFinite,
  kByOutline,      // no depth in this frame
  kLittleOutline,  // no depth in this frame
  // A search
  kAmbiguous,
  kNothingFound,
  kNoReadingInMask,
  kFoundAgain,
  kNotConfirmed,
  kFoundStanding,
  kPrimitiveNotFound,  // text: its kind
  // Several objects
  kSamePlace,  // object: which one is tracked there; this one is given up
  kOverlaps,   // object: the other one, by its name; both are doubted
  kPlacedByNeighbors,
  kMaybeExchanged,  // object
  // A reconstruction
  kBeyondMask,  // percent
  kCount
};

// Whether it concerns the frame, not the pose.
constexpr bool is_frame_fault(ReasonCode code) {
  return code >= ReasonCode::kRepeatedDepth && code <= ReasonCode::kExposureJump;
}

// A code with its arguments.
struct Reason {
  ReasonCode code = ReasonCode::kNone;
  int percent = 0;
  int object = -1;
  std::string text = {};
  ReasonCode frame = ReasonCode::kNone;  // what is also wrong with the frame; appended to the sentence
  std::string more = {};                 // appended last: what is seen where the object was looked for

  bool empty() const { return code == ReasonCode::kNone; }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [code, share, other, words, fault, added] = self;
    constexpr auto kLast = static_cast<ReasonCode>(int(ReasonCode::kCount) - 1);
    archive.choice(code, kLast), archive(share, other, words), archive.choice(fault, kLast), archive(added);
  }
};

inline Reason reason_with_percent(ReasonCode code, int percent) { return {code, percent}; }
inline Reason reason_about(ReasonCode code, int object) { return {code, 0, object}; }

// Empty, or one sentence. names: of the tracker's objects; without names "object 0", "object 1", ...
std::string sentence(const Reason& reason, const std::vector<std::string>& names = {});

}  // namespace sdftrack::tracking
