// SPDX-License-Identifier: Apache-2.0
#include "document/history.h"

#include <algorithm>
#include <utility>

#include "document/digest.h"

namespace robomosp::document {
namespace {

constexpr std::size_t kStepOverhead = 256;   // the step itself, its label, its place in the queue
constexpr std::size_t kChangeOverhead = 64;  // one entry of `changes`

}  // namespace

void merge_changes(std::vector<RecordChange>& into, std::vector<RecordChange> later) {
  constexpr std::size_t kFew = 16;
  std::unordered_map<AnyId, std::size_t> at;
  if (into.size() > kFew && later.size() > kFew)
    for (std::size_t i = 0; i < into.size(); ++i) at.emplace(into[i].id, i);
  for (RecordChange& c : later) {
    std::size_t i = into.size();
    if (!at.empty()) {
      const auto known = at.find(c.id);
      if (known != at.end()) i = known->second;
    } else {
      i = static_cast<std::size_t>(
          std::find_if(into.begin(), into.end(),
                       [&](const RecordChange& o) { return o.id == c.id; }) -
          into.begin());
    }
    if (i < into.size()) into[i].after = std::move(c.after);
    else into.push_back(std::move(c));
  }
}

std::size_t History::weigh(const Step& step) {
  // A record after an edit is kept by the document, or as the one before by the next step; once
  // undone it is kept by this step alone.
  std::size_t bytes = kStepOverhead + step.deed->label.size() + step.series.size();
  for (const RecordChange& c : step.changes) {
    const RecordPtr& kept = step.undone ? c.after : c.before;
    const RecordPtr& other = step.undone ? c.before : c.after;
    bytes += kChangeOverhead + (kept ? record_bytes(*kept, other.get()) : 0);
  }
  return bytes;
}

void History::add(std::shared_ptr<const Deed> deed, std::string series,
                  std::vector<RecordChange> changes) {
  const std::uint64_t session = deed->author.session;
  if (undone_)
    std::erase_if(steps_, [&](const Step& s) {
      if (!s.undone || s.deed->author.session != session) return false;
      bytes_ -= s.bytes;
      --undone_;
      return true;
    });
  if (!series.empty() && !steps_.empty() && steps_.back().series == series &&
      steps_.back().deed->author.session == session) {
    Step& top = steps_.back();
    merge_changes(top.changes, std::move(changes));
    top.deed = std::move(deed);
    bytes_ -= top.bytes;
    bytes_ += top.bytes = weigh(top);
  } else {
    Step step{next_++, std::move(deed), std::move(series), std::move(changes), 0, 0};
    bytes_ += step.bytes = weigh(step);
    steps_.push_back(std::move(step));
  }
  bound();
}

Step* History::next_undo(std::optional<std::uint64_t> session) {
  for (auto it = steps_.rbegin(); it != steps_.rend(); ++it)
    if (!it->undone && (!session || it->deed->author.session == *session)) return &*it;
  return nullptr;
}

Step* History::next_redo(std::optional<std::uint64_t> session) {
  if (!undone_) return nullptr;
  Step* last = nullptr;
  for (Step& s : steps_)
    if (s.undone && (!session || s.deed->author.session == *session) &&
        (!last || s.undone > last->undone))
      last = &s;
  return last;
}

Step* History::find(std::uint64_t number) {
  const auto at = std::lower_bound(steps_.begin(), steps_.end(), number,
                                   [](const Step& s, std::uint64_t n) { return s.number < n; });
  return at == steps_.end() || at->number != number ? nullptr : &*at;
}

void History::mark(Step& step, bool undone) {
  undone_ += undone ? 1 : 0;
  undone_ -= step.undone && !undone ? 1 : 0;
  step.undone = undone ? ++undos_ : 0;
  bytes_ -= step.bytes;
  bytes_ += step.bytes = weigh(step);
  end_series();
}

void History::end_series() {
  for (auto it = steps_.rbegin(); it != steps_.rend(); ++it) {
    it->series.clear();
    if (!it->undone) return;  // steps that are undone go when the next one comes
  }
}

std::deque<Step> History::clear() {
  std::deque<Step> gone = std::exchange(steps_, {});
  bytes_ = 0;
  undone_ = 0;
  forgotten_ = 0;
  return gone;
}

void History::set_budget(std::size_t bytes) {
  budget_ = bytes;
  forgotten_ = 0;
  bound();
}

void History::bound() {
  while (bytes_ > budget_ && steps_.size() > 1) {
    bytes_ -= steps_.front().bytes;
    undone_ -= steps_.front().undone ? 1 : 0;
    steps_.pop_front();
    ++forgotten_;
  }
}

}  // namespace robomosp::document
