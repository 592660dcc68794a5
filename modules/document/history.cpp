// SPDX-License-Identifier: Apache-2.0
#include "document/history.h"

#include <algorithm>
#include <tuple>
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
  drop_undone(session);
  if (!series.empty() && !steps_.empty() && steps_.back().number == open_ &&
      steps_.back().series == series && steps_.back().deed->author.session == session) {
    Step& top = steps_.back();
    merge_changes(top.changes, std::move(changes));
    top.deed = std::move(deed);
    bytes_ -= top.bytes;
    bytes_ += top.bytes = weigh(top);
  } else {
    Step step{next_++, std::move(deed), std::move(series), std::move(changes), 0, 0};
    bytes_ += step.bytes = weigh(step);
    open_ = step.number;
    of_session_[session].done.insert(step.number);
    steps_.push_back(std::move(step));
  }
  bound();
}

void History::drop_undone(std::uint64_t session) {
  const auto at = of_session_.find(session);
  if (at == of_session_.end() || at->second.undone.empty()) return;
  std::size_t left = at->second.undone.size();
  at->second.undone.clear();
  const auto goes = [&](const Step& s) { return s.undone && s.deed->author.session == session; };
  for (; left > 0 && goes(steps_.back()); --left) {
    bytes_ -= steps_.back().bytes;
    steps_.pop_back();
  }
  if (left > 0)  // steps of others stand between
    std::erase_if(steps_, [&](const Step& s) {
      if (!goes(s)) return false;
      bytes_ -= s.bytes;
      return true;
    });
}

Step* History::next_undo(std::optional<std::uint64_t> session) {
  std::uint64_t newest = 0;
  for (const auto& [of, own] : of_session_)
    if ((!session || of == *session) && !own.done.empty())
      newest = std::max(newest, *own.done.rbegin());
  return newest ? find(newest) : nullptr;
}

Step* History::next_redo(std::optional<std::uint64_t> session) {
  std::uint64_t latest = 0, number = 0;
  for (const auto& [of, own] : of_session_)
    if ((!session || of == *session) && !own.undone.empty() && own.undone.rbegin()->first > latest)
      std::tie(latest, number) = *own.undone.rbegin();
  return number ? find(number) : nullptr;
}

Step* History::find(std::uint64_t number) {
  const auto at = std::lower_bound(steps_.begin(), steps_.end(), number,
                                   [](const Step& s, std::uint64_t n) { return s.number < n; });
  return at == steps_.end() || at->number != number ? nullptr : &*at;
}

void History::mark(Step& step, bool undone) {
  Own& of = own(step);
  if (step.undone) of.undone.erase(step.undone);
  else of.done.erase(step.number);
  step.undone = undone ? ++undos_ : 0;
  if (undone) of.undone.emplace(step.undone, step.number);
  else of.done.insert(step.number);
  bytes_ -= step.bytes;
  bytes_ += step.bytes = weigh(step);
  end_series();
}

void History::end_series() { open_ = 0; }

std::deque<Step> History::clear() {
  std::deque<Step> gone = std::exchange(steps_, {});
  of_session_.clear();
  open_ = 0;
  bytes_ = 0;
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
    const Step& oldest = steps_.front();
    bytes_ -= oldest.bytes;
    if (oldest.undone) own(oldest).undone.erase(oldest.undone);
    else own(oldest).done.erase(oldest.number);
    steps_.pop_front();
    ++forgotten_;
  }
}

}  // namespace robomosp::document
