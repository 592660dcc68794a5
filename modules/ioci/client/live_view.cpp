// SPDX-License-Identifier: Apache-2.0
#include "ioci/client/live_view.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>
#include <variant>

#include "ioci/core/commands.h"
#include "ioci/core/drafts.h"
#include "ioci/view/map_view.h"
#include "ioci/view/run_motion.h"
#include "kernel/executor.h"
#include "kernel/text.h"
#include "scene/build.h"
#include "scene/live_scene.h"

namespace robomosp::ioci {
namespace {

/// What moves the members of the world.
struct ByRecording {
  std::uint64_t number = 0;
  double time = 0;
};
struct ByRun {
  std::uint64_t number = 0;
};
using Mover = std::variant<std::monostate, ByRecording, ByRun>;

/// What changed since the worker looked last.
struct Dirty {
  bool what = false, document = false, providers = false, extras = false, mover = false,
       frame = false, beside = false, returned = false;
  [[nodiscard]] bool is_shown() const {
    return what || document || providers || extras || mover || frame || beside;
  }
  [[nodiscard]] bool any() const { return is_shown() || returned; }
};

AnyId record_of(const Handle& h) {
  const auto kind = kind_from(h.kind);
  return kind ? AnyId{*kind, h.number} : AnyId{};
}

std::uint64_t number_in(const Notice& notice) {
  const Value* number = notice.facts.find("draft");
  return number && number->as_int() ? static_cast<std::uint64_t>(*number->as_int()) : 0;
}

/// Pictures kept to make the next ones from: the host shows one, another waits for it.
constexpr std::size_t kSpares = 2;

void append(render::Scene& scene, const render::Scene& more) {
  scene.items.insert(scene.items.end(), more.items.begin(), more.items.end());
  scene.legends.insert(scene.legends.end(), more.legends.begin(), more.legends.end());
}

}  // namespace

/// Shared with the tasks of the executor, of which at most one runs at a time.
struct LiveView::State : std::enable_shared_from_this<LiveView::State> {
  State(Application& a, Options o) : app(a), options(std::move(o)) {}

  Application& app;
  Options options;              ///< callbacks are called while the client is there
  std::shared_ptr<State> main;  ///< whose client this view uses; null = its own
  std::vector<std::weak_ptr<State>> beside_views;  ///< that use this one's; the host's thread's
  std::unique_ptr<Client> client;                  ///< null if `main` is not
  std::atomic<Client*> serving{nullptr};           ///< where solvers of scripts are served
  std::atomic<bool> serves{false};                 ///< a call for that waits
  std::unique_ptr<Scripts> scripts;                ///< of the client's thread
  PicturePtr delivered;                            ///< of the host's thread

  mutable std::mutex mutex;
  std::condition_variable changed;
  // Guarded by mutex:
  Dirty dirty;
  AnyId what;
  scene::Extras extras;
  Mover mover;
  std::shared_ptr<const render::Scene> beside;  ///< the map
  std::shared_ptr<document::Draft> draft;       ///< shown instead of the document; null = none
  std::uint64_t draft_number = 0;
  std::shared_ptr<scene::LiveScene> scene;  ///< changed by the worker
  PicturePtr newest;
  bool is_working = false, is_ending = false, is_new = false, is_woken = false;
  std::string printed;  ///< by scripts, not delivered yet
  // Destroyed by the worker, since that takes time:
  std::vector<std::unique_ptr<Picture>> returned;
  std::vector<std::shared_ptr<const void>> trash;

  // Of the worker:
  scene::MotionPtr motion;
  std::optional<std::string> motion_failure, draft_failure;
  scene::FramePtr last_frame;
  std::vector<std::unique_ptr<Picture>> spares;

  template <class Change>
  void want(const Change& change) {
    {
      const std::lock_guard lock(mutex);
      if (is_ending) return;
      change();
      if (is_working || !dirty.any()) return;
      is_working = true;
    }
    Executor::of_process().run([self = shared_from_this()] { self->work(); });
  }
  void wake() {
    if (options.wake) options.wake();
  }
  /// Hands over something to be destroyed by the worker. Not with mutex held.
  void throw_away(std::shared_ptr<const void> old) {
    if (!old) return;
    want([&] {
      trash.push_back(std::move(old));
      dirty.returned = true;
    });
  }
  void take_back(std::unique_ptr<Picture> old) {
    want([&] {
      returned.push_back(std::move(old));
      // A few wait for the next picture.
      dirty.returned = dirty.returned || returned.size() > kSpares;
    });
  }
  /// The same object, thrown away by whoever lets go of it last.
  template <class T>
  [[nodiscard]] std::shared_ptr<const T> lent(std::shared_ptr<const T> object) {
    const T* const raw = object.get();
    return {raw, [weak = weak_from_this(), object = std::move(object)](const T*) mutable {
              if (const auto self = weak.lock()) self->throw_away(std::move(object));
              object.reset();
            }};
  }
  [[nodiscard]] PicturePtr lent(std::unique_ptr<Picture> picture) {
    return {picture.release(), [weak = weak_from_this()](Picture* p) {
              std::unique_ptr<Picture> old(p);
              if (const auto self = weak.lock()) self->take_back(std::move(old));
            }};
  }
  /// The view with the client.
  [[nodiscard]] State& session() { return main ? *main : *this; }
  void print(std::string_view text) {
    {
      const std::lock_guard lock(mutex);
      printed += text;
    }
    wake();
  }
  /// A call for the scripts' solvers.
  void serve_scripts() {
    Client* const on = serving.load();
    if (!on || serves.exchange(true)) return;
    (void)on->run("serving the solvers of scripts", [this](Session&) -> Result<Value> {
      serves = false;
      if (scripts) scripts->serve();
      return Value();
    });
  }
  void take(const Event& e) {
    switch (e.topic) {
      case Topic::change: want([this] { dirty.document = true; }); break;
      case Topic::provider: want([this] { dirty.providers = true; }); break;
      case Topic::run:
        want([&] {
          const auto* by = std::get_if<ByRun>(&mover);
          dirty.mover = dirty.mover || (by && e.run && by->number == e.run->run);
        });
        break;
      case Topic::draft:
        want([&] {
          dirty.document = dirty.document || (draft && number_in(*e.notice) == draft_number);
        });
        break;
      default: break;
    }
    for (const std::weak_ptr<State>& view : beside_views)
      if (const auto other = view.lock()) other->take(e);
    if (options.on_event && (options.topics & bit(e.topic)) != 0) options.on_event(e);
  }

  void work() {
    std::unique_lock lock(mutex);
    while (dirty.any() && !is_ending) {
      const Dirty now = std::exchange(dirty, {});
      auto old = std::exchange(trash, {});
      auto pictures = std::exchange(returned, {});
      lock.unlock();
      old.clear();
      keep_spares(std::move(pictures));
      if (now.is_shown()) step(now);
      lock.lock();
    }
    is_working = false;
    changed.notify_all();
  }
  void keep_spares(std::vector<std::unique_ptr<Picture>> pictures) {
    for (auto& p : pictures) {
      p->frame = nullptr;
      spares.push_back(std::move(p));
    }
    // The newest ones differ least from the next.
    const auto number = [](const std::unique_ptr<Picture>& p) {
      return p->flat.frame() ? p->flat.frame()->number : 0;
    };
    std::sort(spares.begin(), spares.end(),
              [&](const auto& a, const auto& b) { return number(a) > number(b); });
    if (spares.size() > kSpares) spares.resize(kSpares);
  }
  void step(Dirty now) {
    if (now.what) renew();
    std::shared_ptr<scene::LiveScene> on;
    std::shared_ptr<document::Draft> previewed;
    AnyId shown;
    scene::Extras wanted;
    Mover by;
    {
      const std::lock_guard lock(mutex);
      on = scene;
      previewed = draft;
      shown = what;
      wanted = extras;
      by = mover;
    }
    if (!on) return;
    if (now.providers) on->refresh();
    const std::optional<std::string> had_draft_failure = std::exchange(draft_failure, {});
    const document::SnapshotPtr snapshot = snapshot_of(previewed);
    if (now.what || now.extras) on->show(wanted);
    const std::optional<std::string> failed_before = motion_failure;
    // A motion is read again with the document, in which robots may have other joints.
    if (now.what || now.mover || (now.document && by.index() != 0)) {
      auto moved = motion_by(by, *snapshot, shown);
      motion_failure.reset();
      if (moved.ok()) motion = std::move(*moved);
      else motion_failure = moved.error().sentence();
      on->move(motion);
    }
    on->follow(snapshot);
    // Changes that LiveScene computes come back as a frame; the others are drawn at once.
    draw(*on, wanted.explode,
         now.what || now.beside || now.extras || motion_failure != failed_before ||
             draft_failure != had_draft_failure);
  }
  /// The records to show: of the document, or of a draft while it is open.
  document::SnapshotPtr snapshot_of(const std::shared_ptr<document::Draft>& previewed) {
    if (previewed && !previewed->is_open()) {
      const std::lock_guard lock(mutex);
      if (draft == previewed) draft.reset();
    }
    if (!previewed || !previewed->is_open()) return app.document.now();
    auto shown = previewed->preview();
    if (shown.ok()) return *shown;
    draft_failure = "The draft " + text::quote(previewed->label()) +
                    " is shown without later changes of the document, with which it is in "
                    "conflict: " +
                    shown.error().message + ".";
    return previewed->now();
  }
  void renew() {
    std::shared_ptr<scene::LiveScene> fresh;
    {
      const std::lock_guard lock(mutex);
      fresh = std::make_shared<scene::LiveScene>(app.derived, app.registry, what,
                                                 Executor::of_process(), &app.collision_models);
    }
    fresh->on_frame([this] { want([this] { dirty.frame = true; }); });
    motion = nullptr;
    last_frame = nullptr;
    spares.clear();
    {
      const std::lock_guard lock(mutex);
      scene.swap(fresh);
    }
    // Here the old one ends, if settle() does not use it.
  }
  Result<scene::MotionPtr> motion_by(const Mover& by, const document::Snapshot& snapshot,
                                     AnyId subject) const {
    if (const auto* r = std::get_if<ByRecording>(&by)) {
      const auto recording = app.recordings.find(r->number);
      if (!recording)
        return error(ErrorCode::stale_handle,
                     "the recording #" + std::to_string(r->number) + " no longer exists",
                     "Show another one.");
      RMP_TRY_ASSIGN(
          scene::Motion at,
          subject.kind == Kind::robot
              ? scene::motion_at(snapshot, RobotId{subject.number}, *recording, r->time)
              : scene::motion_at(snapshot, WorldId{subject.number}, *recording, r->time));
      return scene::MotionPtr(std::make_shared<const scene::Motion>(std::move(at)));
    }
    if (const auto* r = std::get_if<ByRun>(&by)) {
      const LiveRunPtr run = app.runs->find(r->number);
      if (!run)
        return error(ErrorCode::stale_handle,
                     "the run #" + std::to_string(r->number) + " no longer exists",
                     "Show another one.");
      return run_motion(snapshot, subject, *run);
    }
    return scene::MotionPtr();
  }
  /// Makes a picture of the newest frame unless it has one and nothing else changed.
  void draw(const scene::LiveScene& on, double explode, bool is_other) {
    const scene::FramePtr frame = on.frame();
    if (frame->number == 0 || (frame == last_frame && !is_other)) return;
    std::shared_ptr<const render::Scene> more;
    {
      const std::lock_guard lock(mutex);
      more = beside;
    }
    std::unique_ptr<Picture> made;
    if (spares.empty()) {
      made = std::make_unique<Picture>();
    } else {
      made = std::move(spares.front());
      spares.erase(spares.begin());
    }
    made->frame = lent(frame);
    made->left_out.clear();
    if (frame->failure) {
      made->flat.show(render::Scene());
    } else if (explode > 0) {
      auto built = scene::built_of(*frame, explode);
      if (built.ok()) {
        if (more) append(built->scene, *more);
        made->flat.show(std::move(built->scene));
        made->left_out = std::move(built->left_out);
      }
    } else {
      made->flat.show(frame, more);
      made->left_out = made->flat.left_out();
    }
    for (const auto* failure : {&motion_failure, &draft_failure})
      if (*failure) made->left_out.push_back(**failure);
    made->only_moved = false;
    if (last_frame && !is_other && explode == 0) {
      const bool follows = frame->since.from == last_frame->number;
      const scene::Changes c =
          follows ? scene::Changes() : scene::changes_between(last_frame.get(), *frame);
      const scene::Changes& changes = follows ? frame->since : c;
      made->only_moved =
          changes.added.empty() && changes.changed.empty() && changes.removed.empty();
    }
    last_frame = frame;
    bool wakes = false;
    PicturePtr old;
    {
      const std::lock_guard lock(mutex);
      // Of pictures that nobody saw, the changes add up.
      if (is_new && !newest->only_moved) made->only_moved = false;
      old = std::exchange(newest, lent(std::move(made)));
      is_new = true;
      wakes = !std::exchange(is_woken, true);
    }
    if (wakes) wake();
  }
};

Result<std::unique_ptr<LiveView>> LiveView::open(Application& app, Options options) {
  const auto state = std::make_shared<State>(app, std::move(options));
  State* const s = state.get();
  s->extras = s->options.extras;
  Client::Options c;
  c.name = s->options.name;
  c.kind = s->options.kind;
  c.wake = [s] { s->wake(); };
  c.waits_for_host = s->options.waits_for_host;
  c.prepare = [s](Session& session) {
    if (const auto make = ScriptLanguage::registered())
      s->scripts = make(s->app, session, s->options.plugin_path, [s] { s->serve_scripts(); });
    if (s->scripts && s->options.on_print)
      s->scripts->print_to([s](std::string_view text) { s->print(text); });
  };
  c.finish = [s](Session&) { s->scripts.reset(); };
  c.events.topics = s->options.topics | bit(Topic::change) | bit(Topic::provider) |
                    bit(Topic::run) | bit(Topic::draft);
  c.on_event = [s](const Event& e) { s->take(e); };
  RMP_TRY_ASSIGN(s->client, Client::open(app, std::move(c)));
  s->serving = s->client.get();
  s->serve_scripts();  // what asked before
  return std::unique_ptr<LiveView>(new LiveView(state));
}

std::unique_ptr<LiveView> LiveView::open_beside(Options options) {
  options.on_event = nullptr;
  const auto state = std::make_shared<State>(state_->app, std::move(options));
  state->main = state_->main ? state_->main : state_;
  state->extras = state->options.extras;
  auto& views = state->main->beside_views;
  std::erase_if(views, [](const std::weak_ptr<State>& v) { return v.expired(); });
  views.push_back(state);
  return std::unique_ptr<LiveView>(new LiveView(state));
}

LiveView::LiveView(std::shared_ptr<State> state) : state_(std::move(state)) {}

LiveView::~LiveView() {
  // What is computed may wait for a solver of the client's scripts, and the client for a command:
  // it is cancelled first.
  if (state_->client) state_->client->close();
  {
    std::unique_lock lock(state_->mutex);
    state_->is_ending = true;
    state_->changed.notify_all();
    state_->changed.wait(lock, [this] { return !state_->is_working; });
  }
  state_->scene.reset();
  state_->client.reset();
  state_->options = {};  // the task that ended last may still hold the rest
}

Client& LiveView::client() const { return *state_->session().client; }

Client::Answer LiveView::evaluate(std::string input, Client::Done done,
                                  std::shared_ptr<List> shown) {
  return client().run(
      "the console",
      [s = &state_->session(), input = std::move(input),
       shown = std::move(shown)](Session&) -> Result<Value> {
        if (!s->scripts)
          return error(ErrorCode::unsupported, "this program has no scripting language");
        RMP_TRY_ASSIGN(std::string text, s->scripts->evaluate(input, shown.get()));
        return Value(std::move(text));
      },
      std::move(done));
}

Client::Answer LiveView::complete(std::string input, std::size_t cursor,
                                  std::function<void(const Completed&)> done) {
  const auto found = std::make_shared<Completed>();
  return client().run(
      "completion",
      [s = &state_->session(), found, input = std::move(input), cursor](Session&) -> Result<Value> {
        if (!s->scripts)
          return error(ErrorCode::unsupported, "this program has no scripting language");
        found->completion = s->scripts->complete(input, cursor);
        found->is_incomplete = s->scripts->is_incomplete(input);
        return Value();
      },
      [found, done = std::move(done)](const Result<Value>& r) {
        if (r.ok() && done) done(*found);
      });
}

Client::Answer LiveView::open_record(OpenRequest request,
                                     std::function<void(const Result<Opened>&)> done) {
  const auto opened = std::make_shared<Opened>();
  return client().run(
      "opening " + (request.script.empty() ? request.what : request.script.string()),
      [s = &state_->session(), opened,
       request = std::move(request)](Session& session) -> Result<Value> {
        RMP_TRY_ASSIGN(*opened, open_shown(s->app, session, s->scripts.get(), request));
        return Value();
      },
      [opened, done = std::move(done)](const Result<Value>& r) {
        if (done) done(r.ok() ? Result<Opened>(*opened) : Result<Opened>(r.error()));
      });
}

Client::Answer LiveView::compute_map(const Handle& what, std::string map, std::string robot,
                                     Client::Done done) {
  return client().run(
      "computing a map",
      [s = &state_->session(), what, map = std::move(map),
       robot = std::move(robot)](Session& session) -> Result<Value> {
        RMP_TRY_ASSIGN(Handle made, ioci::compute_map(s->app, session, what, map, robot));
        return Value(std::move(made));
      },
      std::move(done));
}

Client::Answer LiveView::show_draft(const Client::Edits& draft, Client::Done done) {
  return client().run(
      "previewing a draft",
      [s = state_.get(), draft](Session& session) -> Result<Value> {
        RMP_TRY_ASSIGN(const std::uint64_t number, s->session().client->draft_number(draft));
        RMP_TRY_ASSIGN(auto on, s->app.kept<Drafts>().own(session, number));
        s->want([&] {
          s->draft.swap(on);
          s->draft_number = number;
          s->dirty.document = true;
        });
        return Value();
      },
      std::move(done));
}

void LiveView::show_document() {
  std::shared_ptr<document::Draft> old;
  state_->want([&] {
    old.swap(state_->draft);
    state_->dirty.document = true;
  });
  state_->throw_away(std::move(old));
}

void LiveView::show(const Handle& what) {
  std::shared_ptr<const render::Scene> old;
  state_->want([&] {
    state_->what = record_of(what);
    state_->mover = {};
    old = std::exchange(state_->beside, nullptr);
    state_->dirty.what = true;
  });
  state_->throw_away(std::move(old));
}

void LiveView::show_recording(const Handle& recording, double time) {
  state_->want([&] {
    state_->mover = ByRecording{recording.number, time};
    state_->dirty.mover = true;
  });
}

void LiveView::show_run(const Handle& run) {
  state_->want([&] {
    state_->mover = ByRun{run.number};
    state_->dirty.mover = true;
  });
}

void LiveView::rest() {
  state_->want([&] {
    state_->mover = {};
    state_->dirty.mover = true;
  });
}

Result<void> LiveView::show_layer(std::string_view name, bool is_shown) {
  Result<void> out;
  state_->want([&] {
    out = scene::set_layer(state_->extras, name, is_shown);
    state_->dirty.extras = state_->dirty.extras || out.ok();
  });
  return out;
}

void LiveView::show_extras(scene::Extras extras) {
  state_->want([&] {
    std::swap(state_->extras, extras);
    state_->dirty.extras = true;
  });
}

scene::Extras LiveView::extras() const {
  const std::lock_guard lock(state_->mutex);
  return state_->extras;
}

void LiveView::explode(double by) {
  state_->want([&] {
    state_->extras.explode = by;
    state_->dirty.extras = true;
  });
}

Client::Answer LiveView::show_map(Map map, Client::Done done) {
  return client().run(
      "showing a map",
      [s = state_, map = std::move(map)](Session& session) -> Result<Value> {
        AnyId what;
        {
          const std::lock_guard lock(s->mutex);
          what = s->what;
        }
        NoProgress progress;
        CommandContext ctx(s->app, session, progress);
        auto made = std::make_shared<render::Scene>();
        RMP_TRY(add_map(ctx, Value(map), what, *made));
        s->want([&] {
          if (s->what != what) return;
          s->beside = std::move(made);
          s->dirty.beside = true;
        });
        return Value();
      },
      std::move(done));
}

LiveView::PicturePtr LiveView::picture() const {
  const std::lock_guard lock(state_->mutex);
  return state_->newest;
}

bool LiveView::is_busy() const {
  std::shared_ptr<scene::LiveScene> on;
  {
    const std::lock_guard lock(state_->mutex);
    on = state_->scene;
  }
  // The scene first: its last frame becomes work of the view.
  if (on && on->is_busy()) return true;
  const std::lock_guard lock(state_->mutex);
  return state_->is_working || state_->is_new || state_->dirty.is_shown();
}

Result<LiveView::PicturePtr> LiveView::settle(Progress& progress) {
  State& s = *state_;
  s.want([&] { s.dirty.document = true; });
  for (;;) {
    std::shared_ptr<scene::LiveScene> on;
    {
      std::unique_lock lock(s.mutex);
      while (s.is_working && !s.is_ending) {
        if (progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
        s.changed.wait_for(lock, std::chrono::milliseconds(50));
      }
      if (s.is_ending) return error(ErrorCode::cancelled, "cancelled");
      on = s.scene;
      if (!on) return s.newest;
    }
    RMP_TRY_ASSIGN(const scene::FramePtr frame, on->settle(progress));
    const std::lock_guard lock(s.mutex);
    if (!s.is_working && s.scene == on && s.newest && s.newest->frame == frame) return s.newest;
  }
}

bool LiveView::deliver(std::chrono::microseconds at_most) {
  const std::shared_ptr<State> s = state_;
  const bool has_more = s->client && s->client->deliver(at_most);
  PicturePtr fresh;
  std::string printed;
  {
    const std::lock_guard lock(s->mutex);
    printed.swap(s->printed);
  }
  if (!printed.empty()) s->options.on_print(printed);
  {
    const std::lock_guard lock(s->mutex);
    s->is_woken = false;
    if (!std::exchange(s->is_new, false)) return has_more;
    fresh = s->newest;
  }
  s->delivered = fresh;
  if (s->options.on_picture) s->options.on_picture(fresh);
  return has_more;
}

}  // namespace robomosp::ioci
