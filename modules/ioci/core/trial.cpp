// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/trial.h"

#include "kernel/text.h"

namespace robomosp::ioci {
namespace {

/// A trial is open on this thread.
thread_local bool is_trying_here = false;

/// Cancelled with the command around the trial, or when its time is over.
class TrialProgress final : public Progress {
 public:
  TrialProgress(const Progress& whole, std::chrono::steady_clock::time_point end)
      : whole_(whole), end_(end) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override {
    return whole_.cancelled() || std::chrono::steady_clock::now() > end_;
  }

 private:
  const Progress& whole_;
  std::chrono::steady_clock::time_point end_;
};

}  // namespace

std::unique_ptr<Trial> Trial::open(CommandContext& ctx, const document::Snapshot& base) {
  if (is_trying_here || !ctx.session.may(Effect::edits)) return nullptr;
  return std::unique_ptr<Trial>(new Trial(ctx, base));
}

Trial::Trial(CommandContext& ctx, const document::Snapshot& base)
    : ctx_(ctx),
      draft_(std::make_shared<document::Draft>(ctx.app.document, base, "trial",
                                               ctx.app.author(ctx.session))),
      end_(std::chrono::steady_clock::now() + kLongest) {
  is_trying_here = true;
}

Trial::~Trial() {
  is_trying_here = false;
  (void)draft_->discard();
}

std::string Trial::why_not(const CommandSpec& spec) {
  constexpr Effects kTried = Effects(Effect::reads) | Effect::edits | Effect::files_read;
  const Effects all = spec.effect | spec.sometimes;
  if (all.has(Effect::simulates))
    return "It runs a simulation, which may take minutes and keeps its recording.";
  if (spec.own_transaction || all.meets(Effects::all().without(kTried)))
    return "It changes more than records, which a trial could not take back.";
  return {};
}

Result<Value> Trial::run(std::string_view command, const Map& args) {
  const CommandSpec* spec = ctx_.app.commands.find(command);
  if (!spec) return ctx_.app.commands.unknown(command);
  if (const std::string why = why_not(*spec); !why.empty())
    return error(ErrorCode::permission, text::quote(spec->name) + " is not tried", why);
  TrialProgress progress(ctx_.progress, end_);
  return ctx_.app.dispatch_on_trial(ctx_, draft_, command, args, progress);
}

bool Trial::is_over() const { return std::chrono::steady_clock::now() > end_; }

}  // namespace robomosp::ioci
