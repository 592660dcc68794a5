// SPDX-License-Identifier: Apache-2.0
#include "remote/conversation.h"

#include <algorithm>
#include <utility>

#include "kernel/call_queue.h"
#include "kernel/executor.h"
#include "kernel/text.h"
#include "remote/json.h"

namespace robomosp::remote {
namespace {

using namespace std::chrono_literals;

/// Least time between two notifications of one job.
constexpr auto kProgressEvery = 100ms;
/// A line's buffer that is larger is given back when the line is done [bytes].
constexpr std::size_t kKeptAnswerBuffer = 4096;

}  // namespace

bool Lines::feed(std::string_view bytes, const std::function<bool(std::string_view)>& line,
                 const std::function<bool()>& too_long) {
  while (!bytes.empty()) {
    const auto newline = bytes.find('\n');
    const std::string_view piece = bytes.substr(0, newline);
    const bool is_whole = newline != std::string_view::npos;
    bool go_on = true;
    if (!is_skipping_ && buffer_.size() + piece.size() > longest_) {
      is_skipping_ = true;
      std::string().swap(buffer_);
      go_on = too_long();
    }
    if (!is_skipping_ && is_whole && buffer_.empty()) {
      go_on = line(piece);  // in one piece, as most are
    } else if (!is_skipping_) {
      buffer_.append(piece);
      if (is_whole) go_on = line(buffer_);
    }
    if (is_whole) {
      is_skipping_ = false;
      if (buffer_.capacity() > kKeptAnswerBuffer) std::string().swap(buffer_);
      buffer_.clear();
      bytes.remove_prefix(newline + 1);
    } else {
      bytes = {};
    }
    if (!go_on) return false;
  }
  return true;
}

Conversation::Conversation(ioci::Application& app, ioci::Session& session, RpcServer& server,
                           Options options)
    : app_(app),
      session_(session),
      server_(server),
      options_(std::move(options)),
      signal_waits_(SignalWaits::of(app)),
      beside_(session.name(), session.kind()) {
  copy_rights(beside_);
  server_.watch = [this](std::uint64_t job) { watch(job); };
  gate_->conversation = this;
}

Conversation::~Conversation() {
  server_.watch = {};
  if (watching_) app_.jobs.unsubscribe(watching_);
  if (awaiting_) app_.jobs.unsubscribe(awaiting_);
  {
    const std::lock_guard lock(gate_->mutex);
    gate_->conversation = nullptr;
  }
  std::unique_lock lock(mutex_);
  for (const auto& [number, s] : signals_) {
    signal_waits_->end(s.wait);
    if (s.stop) s.stop();
  }
  for (const JobWait& w : job_waits_)
    options_.say(RpcServer::failure(
        *w.request.as_map()->find("id"),
        error(ErrorCode::cancelled, "the wait was cancelled, since the connection ends",
              "The job continues.", "job.wait")));
  for (ioci::Session& waiting : waits_) waiting.interrupt();
  wait_serving(lock, changed_, [this] { return waits_.empty(); });
}

void Conversation::copy_rights(ioci::Session& to) const { to.limit_as(session_); }

void Conversation::put(Entry entry) {
  {
    const std::lock_guard lock(mutex_);
    inbox_bytes_ += entry.bytes;
    inbox_.push_back(std::move(entry));
  }
  if (options_.ready) options_.ready();
}

void Conversation::take_too_long() { put({.answer = server_.too_long()}); }

void Conversation::take_classic(std::string_view line) {
  line = text::trim(line);
  if (!line.empty()) put({.classic = std::string(line), .bytes = line.size()});
}

void Conversation::take(std::string_view line) {
  line = text::trim(line);
  if (line.empty()) return;
  auto message = from_json(line);
  if (!message.ok()) return put({.answer = RpcServer::not_json(message.error())});
  const Map* m = message->as_map();
  const Value* method = m ? m->find("method") : nullptr;
  const std::string* name = method ? method->as_string() : nullptr;
  if (name && *name == "rpc.cancel") return cancel(*m);
  if (name && *name == "server.wait" && !m->find("job"))
    return options_.after ? wait_for_signal(std::move(*message))
                          : wait_on_a_thread(std::move(*message), false);
  if (!name || !name->starts_with("job.") || m->find("job"))
    return put({.message = std::move(*message), .bytes = line.size()});
  if (*name == "job.wait") return wait_for_job(std::move(*message));
  if (auto text = server_.answer_beside(*message, beside_)) options_.say(std::move(*text));
}

void Conversation::refuse_wait(const Value& request) const {
  if (const Value* id = request.as_map()->find("id"))
    options_.say(
        RpcServer::failure(*id, error(ErrorCode::conflict,
                                      std::to_string(options_.most_waits) +
                                          " requests job.wait and server.wait are already waiting",
                                      "Call job.progress, or wait until one ends.")));
}

/// No thread waits: the answer is sent by whoever makes it come true, or by the timer.
void Conversation::wait_for_signal(Value request) {
  {
    const std::lock_guard lock(mutex_);
    if (waits_.size() + signals_.size() + job_waits_.size() >= options_.most_waits)
      return refuse_wait(request);
  }
  DeferredWait deferred;
  auto text = server_.answer_beside(request, beside_);
  if (!deferred.wish) {
    if (text) options_.say(std::move(*text));
    return;
  }
  const Value* id = request.as_map()->find("id");
  if (!id) return;  // nobody wants to know
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = next_signal_++;
    signals_.emplace(number, SignalWait{*id, 0, *deferred.wish});
  }
  const auto tell = [gate = gate_, number](Result<Value> outcome) {
    const std::lock_guard lock(gate->mutex);
    if (gate->conversation) gate->conversation->signal_told(number, std::move(outcome));
  };
  const auto away = [gate = gate_, seconds = deferred.wish->absent](std::uint64_t wait) {
    const std::lock_guard lock(gate->mutex);
    if (!gate->conversation) return;
    // A timer too many does nothing when its time has come.
    gate->conversation->options_.after(
        seconds, [waits = gate->conversation->signal_waits_, wait] { waits->check_absent(wait); });
  };
  const std::uint64_t wait = signal_waits_->begin(*deferred.wish, tell, away);
  {
    const std::lock_guard lock(mutex_);
    const auto it = signals_.find(number);
    if (it == signals_.end()) return;  // it has come true meanwhile
    it->second.wait = wait;
  }
  auto stop = options_.after(deferred.seconds, [gate = gate_, number, seconds = deferred.seconds] {
    const std::lock_guard lock(gate->mutex);
    if (gate->conversation) gate->conversation->signal_late(number, seconds);
  });
  {
    const std::lock_guard lock(mutex_);
    const auto it = signals_.find(number);
    if (it != signals_.end()) {
      it->second.stop = std::move(stop);
      return;
    }
  }
  stop();
}

void Conversation::signal_late(std::uint64_t number, double seconds) {
  SignalWish wish;
  {
    const std::lock_guard lock(mutex_);
    const auto it = signals_.find(number);
    if (it == signals_.end()) return;
    wish = it->second.wish;
  }
  signal_told(number, signal_waits_->late(wish, seconds));
}

void Conversation::signal_told(std::uint64_t number, Result<Value> outcome) {
  SignalWait s;
  {
    const std::lock_guard lock(mutex_);
    const auto node = signals_.extract(number);
    if (node.empty()) return;
    s = node.mapped();
  }
  signal_waits_->end(s.wait);
  if (s.stop) s.stop();
  options_.say(outcome.ok()
                   ? server_.success(s.id, *outcome)
                   : RpcServer::failure(s.id, std::move(outcome).error().in("server.wait")));
}

/// The job that is asked for, while it waits or runs.
std::optional<std::uint64_t> Conversation::running_job(const Value& request) const {
  const Value* params = request.as_map()->find("params");
  const Value* which = nullptr;  // with nothing else, so that it cannot be refused later
  if (params && params->as_map() && params->as_map()->size() == 1)
    which = params->as_map()->find("id");
  else if (params && params->as_list() && params->as_list()->size() == 1)
    which = &params->as_list()->front();
  if (!which) return std::nullopt;
  const auto job = app_.resolve(*app_.document.now(), "job", *which);
  if (!job.ok() || is_over(job->number)) return std::nullopt;
  return job->number;
}

bool Conversation::is_over(std::uint64_t job) const {
  const auto s = app_.jobs.status(job);
  return !s.ok() || (s->state != JobState::waiting && s->state != JobState::running);
}

/// No thread waits: when the job has ended the request is answered as any other.
void Conversation::wait_for_job(Value request) {
  const auto job = running_job(request);
  if (!job) return wait_on_a_thread(std::move(request), false);  // which is not for long
  {
    const std::lock_guard lock(mutex_);
    if (waits_.size() + signals_.size() + job_waits_.size() >= options_.most_waits)
      return refuse_wait(request);
  }
  if (auto refusal = server_.refuse_beside(request)) return options_.say(std::move(*refusal));
  if (!request.as_map()->find("id")) return;  // nobody wants to know
  if (!awaiting_)
    awaiting_ = app_.jobs.subscribe([gate = gate_](const JobStatus& s) {
      if (s.state == JobState::waiting || s.state == JobState::running) return;
      const std::lock_guard lock(gate->mutex);
      if (gate->conversation) gate->conversation->job_over(s.id);
    });
  {
    const std::lock_guard lock(mutex_);
    job_waits_.push_back({std::move(request), *job});
  }
  if (is_over(*job)) job_over(*job);  // it may have ended in between
}

void Conversation::job_over(std::uint64_t job) {
  std::list<JobWait> over;
  {
    const std::lock_guard lock(mutex_);
    for (auto at = job_waits_.begin(); at != job_waits_.end();) {
      const auto one = at++;
      if (one->job == job) over.splice(over.end(), job_waits_, one);
    }
  }
  for (JobWait& one : over) wait_on_a_thread(std::move(one.request), true);
}

/// A session belongs to one thread, so each that waits gets its own.
void Conversation::wait_on_a_thread(Value request, bool is_admitted) {
  std::list<ioci::Session>::iterator own;
  {
    const std::lock_guard lock(mutex_);
    if (!is_admitted && waits_.size() + signals_.size() + job_waits_.size() >= options_.most_waits)
      return refuse_wait(request);
    own = waits_.emplace(waits_.end(), session_.name(), session_.kind());
  }
  copy_rights(*own);
  Executor::of_process().run([this, own, is_admitted, request = std::move(request)] {
    DeferredWait here;
    here.may_block = true;  // on this thread of its own
    auto text =
        is_admitted ? server_.answer_admitted(request, *own) : server_.answer_beside(request, *own);
    if (text) options_.say(std::move(*text));
    const std::lock_guard lock(mutex_);
    waits_.erase(own);
    changed_.notify_all();
  });
}

/// rpc.cancel {"request": id}: ends the request that runs, or takes back one that waits its turn.
void Conversation::cancel(const Map& message) {
  const Value* id = message.find("id");
  const Value* params = message.find("params");
  const Value* request = params && params->as_map() ? params->as_map()->find("request") : nullptr;
  if (!request) {
    if (id)
      options_.say(RpcServer::failure(
          *id, error(ErrorCode::invalid_argument, "rpc.cancel needs the id of a request",
                     "Send {\"request\": 7}.")));
    return;
  }
  bool found = false;
  std::optional<Value> dropped;
  std::uint64_t signal = 0;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [number, s] : signals_)
      if (s.id == *request) signal = number;
    const auto is_it = [&](const JobWait& w) {
      return *w.request.as_map()->find("id") == *request;
    };
    if (const auto at = std::find_if(job_waits_.begin(), job_waits_.end(), is_it);
        at != job_waits_.end()) {
      found = true;
      dropped = *request;
      job_waits_.erase(at);
    }
    if (running_ && *running_ == *request) {
      found = was_cancelled_ = true;
      cancelling_ = *request;
      session_.interrupt();
    }
    const auto waits = [&](const Entry& e) {
      const Map* m = e.message.as_map();
      const Value* own = m ? m->find("id") : nullptr;
      return own && *own == *request;
    };
    if (const auto it = std::find_if(inbox_.begin(), inbox_.end(), waits);
        !found && it != inbox_.end()) {
      found = true;
      dropped = *request;
      inbox_bytes_ -= it->bytes;
      inbox_.erase(it);
    }
  }
  if (signal != 0) {
    found = true;
    signal_told(signal, error(ErrorCode::cancelled, "the wait was cancelled"));
  }
  if (dropped)
    options_.say(
        RpcServer::failure(*dropped, error(ErrorCode::cancelled, "the request was cancelled")));
  if (id) options_.say(server_.success(*id, Value(found)));
}

bool Conversation::cancel_again() {
  const std::lock_guard lock(mutex_);
  if (!cancelling_) return false;
  if (!running_ || *running_ != *cancelling_) {
    cancelling_.reset();
    return false;
  }
  was_cancelled_ = true;
  session_.interrupt();
  return true;
}

std::string Conversation::run_classic(const std::string& line) {
  session_.clear_interrupt();
  const auto result = app_.dispatch_classic(session_, line);
  if (!result.ok()) {
    const Error e = text::shortened(result.error());
    std::string sentence = text::visible(e.sentence());
    std::replace(sentence.begin(), sentence.end(), '\n', ' ');
    return "error " + std::string(to_string(e.code)) + " " + sentence;
  }
  if (result->is_nil()) return "ok";
  const std::string* word = result->as_string();
  const bool is_plain = word && std::all_of(word->begin(), word->end(), [](char c) {
                          return static_cast<unsigned char>(c) >= 0x20;
                        });
  return "ok " + (is_plain ? *word : to_json(*result, [this](const Handle& h) {
           return app_.name_of(h).value_or("");
         }));
}

bool Conversation::run_next() {
  Entry next;
  {
    const std::lock_guard lock(mutex_);
    if (inbox_.empty()) return false;
    next = std::move(inbox_.front());
    inbox_.pop_front();
    inbox_bytes_ -= next.bytes;
    since_ = Clock::now();
    if (const Map* m = next.message.as_map())
      if (const Value* id = m->find("id")) running_ = *id;
  }
  auto text = next.answer    ? std::move(next.answer)
              : next.classic ? std::optional(run_classic(*next.classic))
                             : server_.answer(next.message);
  {
    // Before the answer is sent: who has it may cancel nothing any more.
    const std::lock_guard lock(mutex_);
    running_.reset();
    since_.reset();
  }
  if (text) options_.say(std::move(*text));
  return true;
}

bool Conversation::has_next() const {
  const std::lock_guard lock(mutex_);
  return !inbox_.empty();
}

std::size_t Conversation::waiting() const {
  const std::lock_guard lock(mutex_);
  return inbox_.size();
}

std::size_t Conversation::waiting_bytes() const {
  const std::lock_guard lock(mutex_);
  return inbox_bytes_;
}

std::optional<Conversation::Clock::time_point> Conversation::running_since() const {
  const std::lock_guard lock(mutex_);
  return since_;
}

bool Conversation::was_cancelled() {
  const std::lock_guard lock(mutex_);
  return std::exchange(was_cancelled_, false);
}

void Conversation::watch(std::uint64_t job) {
  if (!watching_)
    watching_ = app_.jobs.subscribe([gate = gate_](const JobStatus& s) {
      const std::lock_guard lock(gate->mutex);
      if (gate->conversation) gate->conversation->report(s);
    });
  {
    const std::lock_guard lock(mutex_);
    watched_[job] = {};
  }
  // It may have ended in between.
  if (const auto now = app_.jobs.status(job); now.ok()) report(*now);
}

void Conversation::report(const JobStatus& s) {
  const bool is_over = s.state != JobState::waiting && s.state != JobState::running;
  {
    const std::lock_guard lock(mutex_);
    const auto it = watched_.find(s.id);
    if (it == watched_.end()) return;
    const auto now = Clock::now();
    if (!is_over && now - it->second < kProgressEvery) return;
    it->second = now;
    if (is_over) watched_.erase(it);
  }
  options_.say(R"({"jsonrpc":"2.0","method":"job.progress","params":)" +
               to_json(Map{{"id", Handle{"job", s.id}},
                           {"state", to_string(s.state)},
                           {"fraction", s.fraction},
                           {"what", s.what}},
                       [&s](const Handle&) { return s.label; }) +
               "}");
}

}  // namespace robomosp::remote
