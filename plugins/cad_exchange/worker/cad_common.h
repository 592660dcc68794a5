// SPDX-License-Identifier: Apache-2.0
// What reading and writing through Open CASCADE share (layer: plugin). Lengths are millimetres
// wherever an OCCT type appears.
#pragma once

#include <string>
#include <utility>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include <Message_ProgressIndicator.hxx>
#include <Standard_Failure.hxx>
#include <TDocStd_Document.hxx>

namespace robomosp::cad_exchange {

inline constexpr double kMillimetresPerMetre = 1e3;

/// Hands OCCT's progress on and cancellation back.
class ProgressBridge final : public Message_ProgressIndicator {
 public:
  ProgressBridge(Progress& target, double from, double to, std::string what)
      : target_(target), from_(from), to_(to), what_(std::move(what)) {}
  Standard_Boolean UserBreak() override { return target_.cancelled(); }
  void Show(const Message_ProgressScope&, Standard_Boolean) override {
    target_.report(from_ + (to_ - from_) * GetPosition(), what_);
  }

 private:
  Progress& target_;
  double from_, to_;
  std::string what_;
};

/// Stops OCCT from printing; sets what is global to its readers and writers.
void prepare_occt();
/// An empty document with shapes, names and colours.
Handle(TDocStd_Document) new_document();

}  // namespace robomosp::cad_exchange
