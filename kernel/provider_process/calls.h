// SPDX-License-Identifier: Apache-2.0
// Remote calls of interface functions over a channel: from the type of a function to the request
// message, and from the message to the call (layer: core, header-only).
#pragma once

#include <array>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "kernel/provider_process/wire.h"

namespace robomosp::apart {

/// The first word of a reply.
enum class Outcome : std::uint32_t {
  done = 0,
  fault = 1,
  threw = 2,
  threw_unknown = 3,
  misread = 4
};

/// A reply to be sent.
class Reply {
 public:
  virtual ~Reply() = default;
  virtual void measure(Sizer&) = 0;
  virtual void write(Writer&) = 0;
};
/// Receives the reply; once per call.
class Sink {
 public:
  virtual ~Sink() = default;
  virtual void send(Reply&) = 0;
  /// Keeps alive what the called object continues to use: a solver its robot.
  virtual void keep(std::shared_ptr<const void> what, bool is_in_place_of_the_last) = 0;
};
using Serve = void (*)(void* object, std::uint32_t method, Reader& request, Progress&, Sink&);

class Remote;

/// A call to be sent, and its reply.
class Exchange {
 public:
  virtual ~Exchange() = default;
  virtual void measure(Sizer&) = 0;
  virtual void write(Writer&) = 0;
  virtual void read(Reader&) = 0;
  Progress* progress = nullptr;  ///< of the call; null = none
  /// The object's proxy keeps what is lent with this call, and repeats the call to a new process.
  bool is_lasting = false;
  std::string* keep = nullptr;  ///< receives the message, to be repeated later
  bool is_in_out = false;       ///< what it fills is also read
  bool lends = false;           ///< output: it lends objects for the call only
  std::vector<Remote*> also{};  ///< objects of the other side that the call refers to
};

/// The other side. [any thread]
class Peer : public std::enable_shared_from_this<Peer> {
 public:
  virtual ~Peer() = default;
  /// An error reports a failure of the other process; failures of the call are in the reply.
  virtual Result<void> exchange(Remote& object, std::uint32_t method, Exchange&) = 0;
  /// Makes an object of this side available to the other; returns its number, above 0.
  virtual std::uint64_t lend(void* object, Serve serve, std::shared_ptr<void> owner,
                             bool is_for_call) = 0;
  virtual void take_back(std::uint64_t lent) = 0;
  /// An object of this side that the other side refers to; null = none of that kind.
  virtual std::shared_ptr<void> own(std::uint64_t lent, Serve kind) = 0;
  /// Releases an object of the other side.
  virtual void release(std::uint64_t object, std::uint64_t generation) = 0;
  /// Progress of the call that this thread serves.
  [[nodiscard]] virtual Progress& progress() = 0;
  /// Generation of the process in which the next object will be created.
  [[nodiscard]] virtual std::uint64_t generation() const = 0;
};

/// An object of the other side, by its number, with the means to create it again in a new process.
class Remote {
 public:
  std::shared_ptr<Peer> peer;
  std::string name;                 ///< of the provider, for messages
  std::vector<std::string> params;  ///< names of its parameters
  // How to create it: a row of the plugin's table, or a call of another object.
  std::uint32_t row = 0;
  std::shared_ptr<Remote> maker;
  std::uint32_t make_method = 0;
  std::string make_bytes;
  /// Error message if it cannot be created again; else empty.
  std::string lost;
  // The call that binds it to its input.
  std::uint32_t prepare_method = 0;
  std::string prepare_bytes;
  bool is_prepared = false;
  std::vector<std::uint64_t> lent;  ///< objects of this side, during its lifetime
  bool is_borrowed = false;         ///< it exists for one call only, and is not released

  std::mutex mutex;
  std::uint64_t id = 0, generation = 0;  // guarded by mutex

  ~Remote() {
    if (!peer) return;
    for (const std::uint64_t l : lent) peer->take_back(l);
    if (id && !is_borrowed) peer->release(id, generation);
  }
};

// --- parameters of functions ---

/// A parameter on the serving side: read from the request and passed to the function; what the
/// function changes is part of the reply.
template <class P>
struct Slot {
  std::remove_cvref_t<P> value{};
  void read(Reader& r) { fields(r, value); }
  P get(Progress&) {
    if constexpr (std::is_rvalue_reference_v<P>) return std::move(value);
    else return value;
  }
  template <class V>
  void answer(V&) {}
};
/// The same on the calling side.
template <class P>
struct Sent {
  std::remove_reference_t<P>* value;
  template <class V>
  void ask(V& v) {
    fields(v, const_cast<std::remove_cvref_t<P>&>(*value));
  }
  void prepare(Exchange&, Remote&) {}
  void answered(Reader&) {}
};

template <>
struct Slot<Progress&> {
  void read(Reader&) {}
  Progress& get(Progress& own) { return own; }
  template <class V>
  void answer(V&) {}
};
template <>
struct Sent<Progress&> {
  Progress* value;
  template <class V>
  void ask(V&) {}
  void prepare(Exchange& e, Remote&) { e.progress = value; }
  void answered(Reader&) {}
};

/// Values of parameters, for every getter that a provider may call.
class WireParams final : public Params {
 public:
  struct One {
    std::string name, text;
    double real = 0;
    std::int64_t integer = 0;
    bool boolean = false;
    std::vector<double> reals;
    Pose pose;
  };
  std::vector<One> all;
  bool has(std::string_view name) const override { return find(name) != nullptr; }
  double real(std::string_view name) const override { return find(name) ? find(name)->real : 0; }
  long long integer(std::string_view name) const override {
    return find(name) ? find(name)->integer : 0;
  }
  bool boolean(std::string_view name) const override { return find(name) && find(name)->boolean; }
  std::string_view text(std::string_view name) const override {
    return find(name) ? std::string_view(find(name)->text) : std::string_view();
  }
  std::span<const double> reals(std::string_view name) const override {
    return find(name) ? std::span<const double>(find(name)->reals) : std::span<const double>();
  }
  Pose pose(std::string_view name) const override { return find(name) ? find(name)->pose : Pose{}; }

 private:
  const One* find(std::string_view name) const {
    for (const One& o : all)
      if (o.name == name) return &o;
    return nullptr;
  }
};
template <class V>
void fields(V& v, WireParams::One& o) {
  fields(v, o.name);
  fields(v, o.text);
  fields(v, o.real);
  fields(v, o.integer);
  fields(v, o.boolean);
  fields(v, o.reals);
  fields(v, o.pose);
}
template <>
struct Slot<const Params&> {
  WireParams value;
  void read(Reader& r) { fields(r, value.all); }
  const Params& get(Progress&) { return value; }
  template <class V>
  void answer(V&) {}
};
template <>
struct Sent<const Params&> {
  const Params* value;
  std::vector<WireParams::One> all{};
  template <class V>
  void ask(V& v) {
    fields(v, all);
  }
  void prepare(Exchange&, Remote& object) {
    for (const std::string& name : object.params) {
      if (!value->has(name)) continue;
      const auto reals = value->reals(name);
      all.push_back({name,
                     std::string(value->text(name)),
                     value->real(name),
                     value->integer(name),
                     value->boolean(name),
                     {reals.begin(), reals.end()},
                     value->pose(name)});
    }
  }
  void answered(Reader&) {}
};

// --- results ---

/// Writes and reads a result; results that are objects are in proxies.h.
template <class T>
struct Given {
  template <class V>
  static void write(V& v, T& x) {
    fields(v, x);
  }
  static void read(Reader& r, T& x, const std::shared_ptr<Remote>&, std::uint32_t) { fields(r, x); }
};

template <class R>
struct ResultOf {
  using type = R;
  static constexpr bool can_fail = false;
};
template <class T>
struct ResultOf<Result<T>> {
  using type = T;
  static constexpr bool can_fail = true;
};

// --- functions ---

template <class F>
struct Signature;
template <class R, class C, class... P>
struct Signature<R (C::*)(P...)> {
  using Return = R;
  using Class = C;
  using Slots = std::tuple<Slot<P>...>;
  using Sends = std::tuple<Sent<P>...>;
};
template <class R, class C, class... P>
struct Signature<R (C::*)(P...) const> : Signature<R (C::*)(P...)> {};
template <class R, class C, class... P>
struct Signature<R (*)(C&, P...)> : Signature<R (std::remove_const_t<C>::*)(P...)> {};

template <auto M>
struct Constant {};
/// The functions of a class that the other side can call, in order.
template <auto... M>
struct MethodList {
  template <auto Wanted>
  static constexpr std::uint32_t index() {
    std::uint32_t at = 0, found = ~0U;
    ((std::is_same_v<Constant<M>, Constant<Wanted>> ? (found = at++) : at++), ...);
    return found;
  }
  static void serve(void* object, std::uint32_t method, Reader& request, Progress& progress,
                    Sink& sink);
};
template <class C>
struct Methods;

class FaultReply final : public Reply {
 public:
  FaultReply(Outcome outcome, std::string words) : outcome_(outcome), words_(std::move(words)) {}
  void measure(Sizer& v) override { say(v); }
  void write(Writer& v) override { say(v); }

 private:
  template <class V>
  void say(V& v) {
    fields(v, outcome_);
    fields(v, words_);
  }
  Outcome outcome_;
  std::string words_;
};

template <class R, class Slots>
class Answer final : public Reply {
 public:
  using T = typename ResultOf<R>::type;
  explicit Answer(Slots& slots) : slots_(slots) {}
  void measure(Sizer& v) override { say(v); }
  void write(Writer& v) override { say(v); }
  std::optional<std::conditional_t<std::is_void_v<T>, char, T>> value;
  std::optional<Error> fault;

 private:
  template <class V>
  void say(V& v) {
    Outcome outcome = fault ? Outcome::fault : Outcome::done;
    fields(v, outcome);
    if (fault) fields(v, *fault);
    else if constexpr (!std::is_void_v<T>) Given<T>::write(v, *value);
    std::apply([&](auto&... s) { (s.answer(v), ...); }, slots_);
  }
  Slots& slots_;
};

/// Functions that bind an object permanently to their arguments.
template <auto M>
inline constexpr bool kBinds = false;
/// Functions that modify numbers passed to them instead of only filling them in.
template <auto M>
inline constexpr bool kIsInOut = false;

/// Reads the arguments of one function, calls it and replies.
template <auto M>
void serve_one(void* object, Reader& request, Progress& progress, Sink& sink) {
  using S = Signature<decltype(M)>;
  using R = typename S::Return;
  const auto kept = std::make_shared<typename S::Slots>();
  auto& slots = *kept;
  std::apply([&](auto&... s) { (s.read(request), ...); }, slots);
  if (request.is_broken()) {
    FaultReply misread(Outcome::misread, "a message was cut off");
    return sink.send(misread);
  }
  Answer<R, typename S::Slots> answer(slots);
  std::optional<FaultReply> thrown;
  try {
    std::apply(
        [&](auto&... s) {
          auto& c = *static_cast<typename S::Class*>(object);
          if constexpr (std::is_void_v<R>) {
            std::invoke(M, c, s.get(progress)...);
          } else if constexpr (ResultOf<R>::can_fail) {
            auto made = std::invoke(M, c, s.get(progress)...);
            if (!made.ok()) answer.fault = std::move(made).error();
            else if constexpr (!std::is_void_v<typename ResultOf<R>::type>)
              answer.value.emplace(std::move(made).value());
          } else {
            answer.value.emplace(std::invoke(M, c, s.get(progress)...));
          }
        },
        slots);
  } catch (const std::exception& e) {
    thrown.emplace(Outcome::threw, e.what());
  } catch (...) {
    thrown.emplace(Outcome::threw_unknown, "");
  }
  request.bring_back();
  if constexpr (kBinds<M>) {
    using Kept =
        std::pair<std::shared_ptr<typename S::Slots>, std::vector<std::shared_ptr<const void>>>;
    sink.keep(std::make_shared<Kept>(kept, request.take_kept()), !thrown && !answer.fault);
  }
  if (!thrown) {
    try {  // writing the reply calls the new object
      return sink.send(answer);
    } catch (const std::exception& e) {
      thrown.emplace(Outcome::threw, e.what());
    } catch (...) {
      thrown.emplace(Outcome::threw_unknown, "");
    }
  }
  sink.send(*thrown);
}

template <auto... M>
void MethodList<M...>::serve(void* object, std::uint32_t method, Reader& request,
                             Progress& progress, Sink& sink) {
  using One = void (*)(void*, Reader&, Progress&, Sink&);
  static constexpr std::array<One, sizeof...(M)> all{&serve_one<M>...};
  if (method < all.size()) return all.at(method)(object, request, progress, sink);
  FaultReply misread(Outcome::misread, "there is no such function");
  sink.send(misread);
}

/// One call as an exchange: the request, and the outcome.
template <class S>
class Call final : public Exchange {
 public:
  using R = typename S::Return;
  using T = typename ResultOf<R>::type;
  Call(typename S::Sends sends, std::shared_ptr<Remote> object, std::uint32_t method)
      : sends_(std::move(sends)), object_(std::move(object)), method_(method) {
    std::apply([&](auto&... s) { (s.prepare(*this, *object_), ...); }, sends_);
  }
  void measure(Sizer& v) override {
    std::apply([&](auto&... s) { (s.ask(v), ...); }, sends_);
  }
  void write(Writer& v) override {
    std::apply([&](auto&... s) { (s.ask(v), ...); }, sends_);
  }
  void read(Reader& r) override {
    fields(r, outcome);
    if (outcome == Outcome::threw || outcome == Outcome::threw_unknown ||
        outcome == Outcome::misread) {
      fields(r, words);
      return;
    }
    if (outcome == Outcome::fault) fields(r, fault);
    else if (outcome != Outcome::done) return r.fail();
    else if constexpr (!std::is_void_v<T>) Given<T>::read(r, value.emplace(), object_, method_);
    std::apply([&](auto&... s) { (s.answered(r), ...); }, sends_);
  }
  Outcome outcome = Outcome::misread;
  std::string words;
  Error fault;
  std::optional<std::conditional_t<std::is_void_v<T>, char, T>> value;

 private:
  typename S::Sends sends_;
  std::shared_ptr<Remote> object_;
  std::uint32_t method_;
};

struct CallOptions {
  bool is_lasting = false;
  std::string* keep = nullptr;
  bool* lends = nullptr;
};

/// Calls a function of an object of the other side. Its exceptions are thrown again here; a failure
/// of its process is an error, or an exception if the function cannot return one.
template <auto M, class... A>
auto call_with(const std::shared_ptr<Remote>& object, const CallOptions& options, A&&... arguments)
    -> typename Signature<decltype(M)>::Return {
  using S = Signature<decltype(M)>;
  using R = typename S::Return;
  constexpr std::uint32_t method = Methods<typename S::Class>::template index<M>();
  static_assert(method != ~0U, "it is not in the list of its class");
  Call<S> one(typename S::Sends{{&arguments}...}, object, method);
  one.is_lasting = options.is_lasting;
  one.is_in_out = kIsInOut<M>;
  one.keep = options.keep;
  const auto done = object->peer->exchange(*object, method, one);
  if (options.lends) *options.lends = one.lends;
  if (!done.ok()) {
    if constexpr (ResultOf<R>::can_fail) return done.error();
    else throw std::runtime_error(done.error().sentence());
  }
  switch (one.outcome) {
    case Outcome::done: break;
    case Outcome::fault:
      if constexpr (ResultOf<R>::can_fail) return std::move(one.fault);
      else throw std::runtime_error(one.fault.sentence());
    case Outcome::threw: throw std::runtime_error(one.words);
    case Outcome::threw_unknown: throw 0;  // NOLINT: as it was thrown: nothing is known of it
    case Outcome::misread: throw std::runtime_error(one.words);
  }
  if constexpr (ResultOf<R>::can_fail) {
    if constexpr (std::is_void_v<typename ResultOf<R>::type>) return {};
    else return std::move(*one.value);
  } else if constexpr (!std::is_void_v<R>) {
    return std::move(*one.value);
  }
}
template <auto M, class... A>
auto call(const std::shared_ptr<Remote>& object, A&&... arguments) ->
    typename Signature<decltype(M)>::Return {
  return call_with<M>(object, CallOptions{}, std::forward<A>(arguments)...);
}

}  // namespace robomosp::apart
