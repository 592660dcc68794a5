// SPDX-License-Identifier: Apache-2.0
#include "kernel/provider_process/proxies.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <deque>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include <robomosp/sdk/collision_bounds.h>
#include <robomosp/sdk/csg_primitive.h>
#include <robomosp/sdk/language.h>
#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_reader.h>
#include <robomosp/sdk/render.h>
#include <robomosp/sdk/tip_force.h>

#include "kernel/provider_process/sdk_fields.h"
#include "kernel/text.h"

namespace robomosp::apart {
namespace {

// --- objects that are lent and made ---

/// What is asked of an object without a chance to fail: it comes with it.
template <class T>
struct Facts {
  Facts() = default;
  explicit Facts(const T&) {}
  template <class V>
  void io(V&) {}
};
template <>
struct Facts<InverseDynamics> {
  std::uint64_t scratch = 0;
  Facts() = default;
  explicit Facts(const InverseDynamics& d) : scratch(d.scratch_size()) {}
  template <class V>
  void io(V& v) {
    fields(v, scratch);
  }
};
template <>
struct Facts<Curve> {
  double end = 0;
  std::vector<double> knots;
  bool is_timed = false, is_even = false;
  Facts() = default;
  explicit Facts(const Curve& c)
      : end(c.end()), knots(c.knots()), is_timed(c.is_timed()), is_even(c.is_even()) {}
  template <class V>
  void io(V& v) {
    fields(v, end);
    fields(v, knots);
    fields(v, is_timed);
    fields(v, is_even);
  }
};
template <>
struct Facts<MotionLaw> {
  double duration = 0;
  Facts() = default;
  explicit Facts(const MotionLaw& l) : duration(l.duration()) {}
  template <class V>
  void io(V& v) {
    fields(v, duration);
  }
};
template <>
struct Facts<JointSegment> {
  double duration = 0;
  Facts() = default;
  explicit Facts(const JointSegment& s) : duration(s.duration()) {}
  template <class V>
  void io(V& v) {
    fields(v, duration);
  }
};
template <>
struct Facts<Segment> {
  double duration = 0, length = 0;
  Facts() = default;
  explicit Facts(const Segment& s) : duration(s.duration()), length(s.length()) {}
  template <class V>
  void io(V& v) {
    fields(v, duration);
    fields(v, length);
  }
};
template <>
struct Facts<CollisionScene> {
  bool has_bounds = false;
  Facts() = default;
  explicit Facts(const CollisionScene& s)
      : has_bounds(s.extension(CollisionBounds::kId) != nullptr) {}
  template <class V>
  void io(V& v) {
    fields(v, has_bounds);
  }
};
template <>
struct Facts<PhysicsWorld> {
  bool has_notes = false;
  Facts() = default;
  explicit Facts(const PhysicsWorld& w) : has_notes(w.extension(PhysicsNotes::kId) != nullptr) {}
  template <class V>
  void io(V& v) {
    fields(v, has_notes);
  }
};
template <>
struct Facts<CsgShape> {
  std::array<Vec3, 2> bounds{};
  std::vector<std::string> notes;
  Facts() = default;
  explicit Facts(const CsgShape& s)
      : bounds(s.bounds()), notes(s.notes().begin(), s.notes().end()) {}
  template <class V>
  void io(V& v) {
    fields(v, bounds);
    fields(v, notes);
  }
};
template <>
struct Facts<OdeSystem> {
  std::uint64_t size = 0, positions = 0, events = 0;
  Facts() = default;
  explicit Facts(const OdeSystem& s)
      : size(s.size()), positions(s.positions()), events(s.events()) {}
  template <class V>
  void io(V& v) {
    fields(v, size);
    fields(v, positions);
    fields(v, events);
  }
};
template <>
struct Facts<ModuleCall> {
  std::string session;
  Facts() = default;
  explicit Facts(const ModuleCall& c) : session(c.session()) {}
  template <class V>
  void io(V& v) {
    fields(v, session);
  }
};

template <class T>
class Proxy;

/// An object of this side in a message, for the call or for as long as the proxy that it is bound
/// to; of a reader, its proxy.
template <class T, class V>
void lent_fields(V& v, T*& object) {
  using Plainly = std::remove_const_t<T>;
  std::uint64_t id = 0;
  if constexpr (V::is_writer)
    if (object) {
      id = v.peer().lend(const_cast<Plainly*>(object), &Methods<Plainly>::serve, nullptr,
                         !v.is_lasting);
      v.lent.push_back(id);
    }
  bool has = object != nullptr;
  fields(v, has);
  fields(v, id);
  if constexpr (V::is_reader) {
    object = nullptr;
    if (!has || v.is_broken()) return;
    Facts<Plainly> facts;
    facts.io(v);
    auto remote = std::make_shared<Remote>();
    remote->peer = v.peer().shared_from_this();
    remote->id = id;
    remote->generation = v.peer().generation();
    remote->is_borrowed = true;
    remote->lost = "an object passed for a call is no longer valid";
    auto proxy = std::make_shared<Proxy<Plainly>>(std::move(remote), std::move(facts));
    object = proxy.get();
    v.keep(std::move(proxy));
  } else if (has) {
    Facts<Plainly> facts(*object);
    facts.io(v);
  }
}
/// Of functions that are lent an object as a parameter.
template <class T>
struct LentSlot {
  T* value = nullptr;
  void read(Reader& r) {
    lent_fields(r, value);
    if (!value) r.fail();
  }
  T& get(Progress&) { return *value; }
  template <class V>
  void answer(V&) {}
};
template <class T>
struct LentSent {
  T* value;
  template <class V>
  void ask(V& v) {
    lent_fields(v, value);
  }
  void prepare(Exchange& e, Remote&) { e.lends = e.lends || !e.is_lasting; }
  void answered(Reader&) {}
};

template <class T, class Pointer>
void product_write(Sizer& v, Pointer& made) {
  std::uint64_t id = 0;
  bool has = made != nullptr;
  fields(v, has);
  fields(v, id);
  if (!has) return;
  Facts<T> facts(*made);
  facts.io(v);
}
template <class T, class Pointer>
void product_write(Writer& v, Pointer& made) {
  bool has = made != nullptr;
  fields(v, has);
  std::uint64_t id = 0;
  if (!has) return fields(v, id);
  Facts<T> facts(*made);
  std::shared_ptr<const T> owner(std::move(made));
  auto* object = const_cast<T*>(owner.get());
  id = v.peer().lend(object, &Methods<T>::serve, std::const_pointer_cast<T>(owner), false);
  fields(v, id);
  facts.io(v);
}
template <class T>
std::unique_ptr<Proxy<T>> product_read(Reader& r, const std::shared_ptr<Remote>& maker,
                                       std::uint32_t method) {
  bool has = false;
  std::uint64_t id = 0;
  fields(r, has);
  fields(r, id);
  if (!has || r.is_broken()) return nullptr;
  Facts<T> facts;
  facts.io(r);
  auto remote = std::make_shared<Remote>();
  remote->peer = r.peer().shared_from_this();
  remote->name = maker->name;
  remote->maker = maker;
  remote->make_method = method;
  remote->id = id;
  remote->generation = r.peer().generation();
  return std::make_unique<Proxy<T>>(std::move(remote), std::move(facts));
}

}  // namespace

template <class T>
struct Given<std::unique_ptr<T>> {
  template <class V>
  static void write(V& v, std::unique_ptr<T>& x) {
    product_write<T>(v, x);
  }
  static void read(Reader& r, std::unique_ptr<T>& x, const std::shared_ptr<Remote>& maker,
                   std::uint32_t method) {
    x = product_read<T>(r, maker, method);
  }
};
template <>
struct Given<std::shared_ptr<const CsgShape>> {
  template <class V>
  static void write(V& v, std::shared_ptr<const CsgShape>& x) {
    product_write<CsgShape>(v, x);
  }
  static void read(Reader& r, std::shared_ptr<const CsgShape>& x,
                   const std::shared_ptr<Remote>& maker, std::uint32_t method);
};
template <>
struct Given<std::string_view> {
  template <class V>
  static void write(V& v, std::string_view& x) {
    fields(v, x);
  }
};

namespace {

/// Makes a product by one function of its factory, and keeps how.
template <auto M, class T, class... A>
Result<std::unique_ptr<T>> make(const std::shared_ptr<Remote>& factory, A&&... arguments) {
  std::string bytes;
  bool lends = false;
  RMP_TRY_ASSIGN(std::unique_ptr<T> made, call_with<M>(factory, CallOptions{false, &bytes, &lends},
                                                       std::forward<A>(arguments)...));
  if (!made) return made;
  Remote& remote = *static_cast<Proxy<T>&>(*made).remote();
  if (lends) remote.lost = "it was made from an object passed for that call only";
  else remote.make_bytes = std::move(bytes);
  return made;
}
/// Binds a provider to what it works on, and keeps to what.
template <auto M, class... A>
Result<void> bind(const std::shared_ptr<Remote>& solver, A&&... arguments) {
  std::string bytes;
  solver->is_prepared = false;
  for (const std::uint64_t l : std::exchange(solver->lent, {})) solver->peer->take_back(l);
  RMP_TRY(call_with<M>(solver, CallOptions{true, &bytes, nullptr}, std::forward<A>(arguments)...));
  solver->prepare_method = Methods<typename Signature<decltype(M)>::Class>::template index<M>();
  solver->prepare_bytes = std::move(bytes);
  solver->is_prepared = true;
  return {};
}

class Proxied {
 public:
  explicit Proxied(std::shared_ptr<Remote> remote) : remote_(std::move(remote)) {}
  [[nodiscard]] const std::shared_ptr<Remote>& remote() const { return remote_; }

 protected:
  std::shared_ptr<Remote> remote_;
};

}  // namespace

// --- parameters that hold objects ---

template <class V>
void fields(V& v, IkBatch& x) {
  fields(v, x.targets);
  fields(v, x.seeds);
  fields(v, x.tolerance);
  fields(v, x.all_solutions);
  fields(v, x.continuous);
  fields(v, x.tip);
  fields(v, x.goals);
  fields(v, x.objective);
  lent_fields(v, x.clearance);
  fields(v, x.arm_angles);
}
template <class V>
void fields(V& v, OrientationTask& x) {
  fields(v, x.points);
  fields(v, x.shares);
  lent_fields(v, x.curve);
}
template <>
struct Sent<const OrientationTask&> {
  const OrientationTask* value;
  template <class V>
  void ask(V& v) {
    fields(v, const_cast<OrientationTask&>(*value));
  }
  void prepare(Exchange& e, Remote&) { e.lends = e.lends || value->curve; }
  void answered(Reader&) {}
};
/// Many answers, which are no plain numbers: their count goes there, they come back.
template <>
struct Slot<std::span<IkResult>> {
  std::vector<IkResult> value;
  void read(Reader& r) {
    std::uint64_t n = 0;
    fields(r, n);
    if (n > r.size() / sizeof(Pose)) return r.fail();  // each has a target
    value.resize(n);
  }
  std::span<IkResult> get(Progress&) { return value; }
  template <class V>
  void answer(V& v) {
    for (IkResult& x : value) fields(v, x);
  }
};
template <>
struct Sent<std::span<IkResult>> {
  std::span<IkResult>* value;
  template <class V>
  void ask(V& v) {
    std::uint64_t n = value->size();
    fields(v, n);
  }
  void prepare(Exchange&, Remote&) {}
  void answered(Reader& r) {
    for (IkResult& x : *value) fields(r, x);
  }
};
template <>
struct Slot<std::vector<PhysicsContact>&> {
  std::vector<PhysicsContact> value;
  void read(Reader&) {}
  std::vector<PhysicsContact>& get(Progress&) { return value; }
  template <class V>
  void answer(V& v) {
    fields(v, value);
  }
};
template <>
struct Sent<std::vector<PhysicsContact>&> {
  std::vector<PhysicsContact>* value;
  template <class V>
  void ask(V&) {}
  void prepare(Exchange&, Remote&) {}
  void answered(Reader& r) { fields(r, *value); }
};
template <>
struct Slot<const ExportTask&> {
  ExportTask value;
  ExportReport report;
  bool has_report = false;
  void read(Reader& r) {
    fields(r, value);
    fields(r, has_report);
    if (has_report) value.report = &report;
  }
  const ExportTask& get(Progress&) { return value; }
  template <class V>
  void answer(V& v) {
    fields(v, report);
  }
};
template <>
struct Sent<const ExportTask&> {
  const ExportTask* value;
  template <class V>
  void ask(V& v) {
    fields(v, const_cast<ExportTask&>(*value));
    bool has_report = value->report != nullptr;
    fields(v, has_report);
  }
  void prepare(Exchange&, Remote&) {}
  void answered(Reader& r) {
    ExportReport more;
    fields(r, more);
    if (!value->report) return;
    auto& own = *value->report;
    own.notes.insert(own.notes.end(), more.notes.begin(), more.notes.end());
    own.counts.insert(own.counts.end(), more.counts.begin(), more.counts.end());
  }
};
template <>
struct Slot<OdeSystem&> : LentSlot<OdeSystem> {};
template <>
struct Sent<OdeSystem&> : LentSent<OdeSystem> {};
template <>
struct Slot<OdeSink&> : LentSlot<OdeSink> {};
template <>
struct Sent<OdeSink&> : LentSent<OdeSink> {};
template <>
struct Slot<const InverseDynamics&> : LentSlot<const InverseDynamics> {};
template <>
struct Sent<const InverseDynamics&> : LentSent<const InverseDynamics> {};
template <>
struct Slot<ModuleCall&> : LentSlot<ModuleCall> {};
template <>
struct Sent<ModuleCall&> : LentSent<ModuleCall> {};

// --- what both sides serve ---

namespace {

/// The questions that a planner asks.
class PlanQuestions {
 public:
  explicit PlanQuestions(const PlanProblem& p) : problem_(p) {}
  bool is_free(std::span<const double> q) const { return problem_.is_free(q); }
  bool is_free_between(std::span<const double> a, std::span<const double> b) const {
    return problem_.is_free_between(a, b);
  }

 private:
  const PlanProblem& problem_;
};
/// A problem without its functions, which come as an object.
struct PlanWire {
  PlanProblem problem;
  const PlanQuestions* questions = nullptr;
};
Result<Plan> plan_by(const Planner& planner, const PlanWire& wire, const Params& params,
                     Progress& progress);

Result<void> lower_bounds(const CollisionScene& scene, std::span<const Pose> poses,
                          std::span<const CollisionPair> pairs, double interest, double tolerance,
                          std::span<PairDistance> out, Progress& progress) {
  const auto* bounds = static_cast<const CollisionBounds*>(scene.extension(CollisionBounds::kId));
  if (!bounds) return error(ErrorCode::unsupported, "it does not support a distance tolerance");
  return bounds->lower_bounds(poses, pairs, interest, tolerance, out, progress);
}

Result<std::vector<PhysicsNote>> physics_notes(const PhysicsWorld& world) {
  const auto* known = static_cast<const PhysicsNotes*>(world.extension(PhysicsNotes::kId));
  if (!known) return error(ErrorCode::unsupported, "it has no notes");
  return known->notes();
}

using BranchNames = std::vector<std::vector<std::string>>;  ///< three words a choice
Result<BranchNames> ik_branches(const IkSolver& solver, std::int32_t tip) {
  BranchNames out;
  const auto* known = static_cast<const IkBranches*>(solver.extension(IkBranches::kExtensionId));
  if (!known) return error(ErrorCode::unsupported, "it names no branches");
  for (const IkBranchChoice& c : known->choices(tip)) {
    auto& words = out.emplace_back();
    for (const char* word : {c.name, c.positive, c.negative}) words.emplace_back(word ? word : "");
  }
  return out;
}
Result<void> ik_measure(const IkSolver& solver, std::int32_t tip, std::span<const double> q,
                        std::span<double> out) {
  const auto* known = static_cast<const IkBranches*>(solver.extension(IkBranches::kExtensionId));
  if (!known) return error(ErrorCode::unsupported, "it names no branches");
  known->measure(tip, q, out);
  return {};
}
bool has_edges(const CsgEngine& engine) {
  return engine.extension(CsgEdges::kExtensionId) != nullptr;
}
Result<std::vector<CsgEdge>> csg_edges(const CsgEngine& engine, const CsgShape& shape, double chord,
                                       Progress& progress) {
  const auto* edges = static_cast<const CsgEdges*>(engine.extension(CsgEdges::kExtensionId));
  if (!edges) return error(ErrorCode::unsupported, "this CSG engine lists no edges");
  return edges->edges(shape, chord, progress);
}

/// Tables of modules with texts of their own.
struct CommandWire {
  std::string name, summary, details, example, effects, sometimes, result_type, result_unit,
      result_doc;
  std::vector<RowWire> params, result_fields;
};
struct ModuleWire {
  std::vector<CommandWire> commands;
  std::vector<RowWire> settings;
  std::uint32_t runs = 0;
};
RMP_FIELDS(CommandWire, name, summary, details, example, effects, sometimes, result_type,
           result_unit, result_doc, params, result_fields)
RMP_FIELDS(ModuleWire, commands, settings, runs)

constexpr std::uint32_t kMostRows = 4096;
/// Commands of one module: each needs a function of its own here.
constexpr std::size_t kMostCommands = 256;

std::string or_empty(const char* s) { return s ? s : ""; }
std::vector<RowWire> rows_of(const ModuleFields& f) {
  std::vector<RowWire> out;
  if (!f.rows || f.count > kMostRows) return out;
  for (std::uint32_t i = 0; i < f.count; ++i) {
    rmp_param r{};
    std::memcpy(static_cast<void*>(&r),
                reinterpret_cast<const char*>(f.rows) + static_cast<std::size_t>(i) * f.row_size,
                std::min<std::size_t>(f.row_size, sizeof r));
    RowWire& w = out.emplace_back();
    w = {or_empty(r.name),
         or_empty(r.type),
         or_empty(r.unit),
         or_empty(r.doc),
         or_empty(r.label),
         or_empty(r.group),
         {},
         {},
         r.min,
         r.max,
         r.flags};
    if (r.default_text) w.default_text = r.default_text;
    if (r.choices) w.choices = r.choices;
  }
  return out;
}
ModuleCommand command_at(const ModuleTable& t, std::size_t i) {
  ModuleCommand row{};
  std::memcpy(static_cast<void*>(&row),
              reinterpret_cast<const char*>(t.commands) + i * t.command_size,
              std::min<std::size_t>(t.command_size, sizeof row));
  return row;
}
Result<ModuleWire> module_table(const Module& module) {
  const ModuleTable& t = module.table();
  ModuleWire out;
  if (t.command_count > kMostCommands || (t.command_count && !t.commands))
    return error(ErrorCode::unsupported,
                 "a module in a separate process may have " + std::to_string(kMostCommands) +
                     " commands, and this one has " + std::to_string(t.command_count));
  for (std::size_t i = 0; i < t.command_count; ++i) {
    const ModuleCommand c = command_at(t, i);
    out.commands.push_back({or_empty(c.name), or_empty(c.summary), or_empty(c.details),
                            or_empty(c.example), or_empty(c.effects), or_empty(c.sometimes),
                            or_empty(c.result_type), or_empty(c.result_unit),
                            or_empty(c.result_doc), rows_of(c.params), rows_of(c.result_fields)});
  }
  out.settings = rows_of(t.settings);
  out.runs = t.runs;
  return out;
}
Result<ModuleValue> module_run(const Module& module, std::uint32_t index,
                               const ModuleValue& arguments, ModuleCall& host) {
  const ModuleTable& t = module.table();
  const ModuleCommand c = index < t.command_count ? command_at(t, index) : ModuleCommand{};
  if (!c.run) return error(ErrorCode::plugin_failed, "the command has no function");
  return c.run(module, arguments, host);
}

std::vector<std::string> exact_extensions(const Exporter& e, const std::vector<std::string>& all) {
  std::vector<std::string> out;
  for (const std::string& x : all)
    if (e.is_exact(x)) out.push_back(x);
  return out;
}
std::string importer_extensions(const Importer& i) { return std::string(i.extensions()); }
std::string exporter_extensions(const Exporter& e) { return std::string(e.extensions()); }

/// Stands for a shape of another engine, which its own refuses.
class ForeignShape final : public CsgShape {
 public:
  [[nodiscard]] std::array<Vec3, 2> bounds() const override { return {}; }
  [[nodiscard]] std::span<const std::string> notes() const override { return {}; }
};

}  // namespace

template <class V>
void fields(V& v, PlanWire& x) {
  PlanProblem& p = x.problem;
  std::uint64_t dof = p.dof;
  fields(v, dof);
  p.dof = dof;
  for (std::span<const double>* s : {&p.lower, &p.upper, &p.weight, &p.start, &p.goals})
    fields(v, *s);
  fields(v, p.seconds);
  fields(v, p.seed);
  lent_fields(v, p.clearance);
  lent_fields(v, x.questions);
}

template <>
struct Methods<PlanQuestions>
    : MethodList<&PlanQuestions::is_free, &PlanQuestions::is_free_between> {};
template <>
struct Methods<IkSolver>
    : MethodList<&IkSolver::prepare, &IkSolver::solve, &ik_branches, &ik_measure> {};
template <>
struct Methods<ClearanceField> : MethodList<&ClearanceField::distance> {};
template <>
struct Methods<InverseDynamics>
    : MethodList<&InverseDynamics::prepare, &InverseDynamics::scratch_size,
                 &InverseDynamics::torques, &InverseDynamics::inertia,
                 &InverseDynamics::derivatives, &InverseDynamics::regressor,
                 &InverseDynamics::energy> {};
template <>
struct Methods<ForwardDynamics>
    : MethodList<&ForwardDynamics::prepare, &ForwardDynamics::scratch_size,
                 &ForwardDynamics::accelerations, &ForwardDynamics::constrained,
                 &ForwardDynamics::derivatives> {};
template <>
struct Methods<Controller> : MethodList<&Controller::prepare, &Controller::state_size,
                                        &Controller::scratch_size, &Controller::torques> {};
template <>
struct Methods<RobotCodeGenerator> : MethodList<&RobotCodeGenerator::generate> {};
template <>
struct Methods<CurveFactory> : MethodList<&CurveFactory::make> {};
template <>
struct Methods<Curve> : MethodList<&Curve::evaluate> {};
template <>
struct Methods<MotionLawFactory> : MethodList<&MotionLawFactory::make> {};
template <>
struct Methods<MotionLaw> : MethodList<&MotionLaw::sample> {};
template <>
struct Methods<OrientationFactory> : MethodList<&OrientationFactory::make> {};
template <>
struct Methods<Orientation> : MethodList<&Orientation::evaluate> {};
template <>
struct Methods<JointSegmentFactory> : MethodList<&JointSegmentFactory::make> {};
template <>
struct Methods<JointSegment> : MethodList<&JointSegment::sample> {};
template <>
struct Methods<SegmentFactory> : MethodList<&SegmentFactory::make> {};
template <>
struct Methods<Segment> : MethodList<&Segment::sample> {};
template <>
struct Methods<Retimer> : MethodList<&Retimer::retime> {};
template <>
struct Methods<Integrator> : MethodList<&Integrator::prepare, &Integrator::run> {};
template <>
struct Methods<OdeSystem> : MethodList<&OdeSystem::rate, &OdeSystem::project,
                                       &OdeSystem::event_values, &OdeSystem::at_event> {};
template <>
struct Methods<OdeSink> : MethodList<&OdeSink::sample> {};
template <>
struct Methods<CollisionEngine> : MethodList<&CollisionEngine::build> {};
template <>
struct Methods<CollisionScene>
    : MethodList<&CollisionScene::distances, &CollisionScene::collisions, &lower_bounds> {};
template <>
struct Methods<PhysicsEngine> : MethodList<&PhysicsEngine::create> {};
template <>
struct Methods<PhysicsWorld>
    : MethodList<&PhysicsWorld::step, &PhysicsWorld::read, &PhysicsWorld::contacts,
                 &PhysicsWorld::attach, &PhysicsWorld::release, &PhysicsWorld::move,
                 &PhysicsWorld::servo, &PhysicsWorld::push, &PhysicsWorld::ignore, &physics_notes> {
};
template <>
struct Methods<Planner> : MethodList<&plan_by> {};
template <>
struct Methods<Importer> : MethodList<&importer_extensions, &Importer::read> {};
template <>
struct Methods<Exporter> : MethodList<&exporter_extensions, &exact_extensions, &Exporter::write> {};
template <>
struct Methods<CsgPrimitive> : MethodList<&CsgPrimitive::build> {};
template <>
struct Methods<CsgEngine>
    : MethodList<&CsgEngine::evaluate, &CsgEngine::mesh, &CsgEngine::moments, &CsgEngine::partition,
                 &CsgEngine::features, &CsgEngine::section, &CsgEngine::geometry, &has_edges,
                 &csg_edges> {};
template <>
struct Methods<CsgShape> : MethodList<> {};
template <>
struct Methods<Module>
    : MethodList<&module_table, &module_run, &Module::before_run, &Module::after_run> {};
template <>
struct Methods<ModuleCall> : MethodList<&ModuleCall::run, &ModuleCall::setting, &ModuleCall::name,
                                        &ModuleCall::robot_model, &ModuleCall::say> {};

template <>
inline constexpr bool kBinds<&IkSolver::prepare> = true;
template <>
inline constexpr bool kBinds<&InverseDynamics::prepare> = true;
template <>
inline constexpr bool kBinds<&ForwardDynamics::prepare> = true;
template <>
inline constexpr bool kBinds<&Controller::prepare> = true;
template <>
inline constexpr bool kBinds<&Integrator::prepare> = true;
template <>
inline constexpr bool kIsInOut<&Controller::torques> = true;
template <>
inline constexpr bool kIsInOut<&OdeSystem::project> = true;
template <>
inline constexpr bool kIsInOut<&OdeSystem::at_event> = true;

// --- shapes as parameters ---

namespace {

/// A shape by its number on the other side; 0 of another engine's.
std::uint64_t number_of(const CsgShape& shape);
Remote* remote_of(const CsgShape& shape);
std::shared_ptr<const CsgShape> shape_of(Reader& r, std::uint64_t id) {
  static const auto foreign = std::make_shared<const ForeignShape>();
  auto own = id ? r.peer().own(id, &Methods<CsgShape>::serve) : nullptr;
  if (!own) return foreign;
  auto* shape = static_cast<const CsgShape*>(own.get());
  return {std::move(own), shape};
}

}  // namespace

template <>
struct Slot<const CsgShape&> {
  std::shared_ptr<const CsgShape> value;
  void read(Reader& r) {
    std::uint64_t id = 0;
    fields(r, id);
    value = shape_of(r, id);
  }
  const CsgShape& get(Progress&) { return *value; }
  template <class V>
  void answer(V&) {}
};
template <>
struct Sent<const CsgShape&> {
  const CsgShape* value;
  template <class V>
  void ask(V& v) {
    std::uint64_t id = number_of(*value);
    fields(v, id);
  }
  void prepare(Exchange& e, Remote&) {
    if (Remote* r = remote_of(*value)) e.also.push_back(r);
  }
  void answered(Reader&) {}
};
template <>
struct Slot<std::span<const PlacedShape>> {
  std::vector<PlacedShape> value;
  void read(Reader& r) {
    const std::uint64_t n = r.count(sizeof(std::uint64_t) + sizeof(Pose));
    for (std::uint64_t i = 0; i < n && !r.is_broken(); ++i) {
      std::uint64_t id = 0;
      fields(r, id);
      PlacedShape& s = value.emplace_back();
      s.shape = shape_of(r, id);
      fields(r, s.placement);
    }
  }
  std::span<const PlacedShape> get(Progress&) { return value; }
  template <class V>
  void answer(V&) {}
};
template <>
struct Sent<std::span<const PlacedShape>> {
  std::span<const PlacedShape>* value;
  template <class V>
  void ask(V& v) {
    std::uint64_t n = value->size();
    fields(v, n);
    for (const PlacedShape& s : *value) {
      std::uint64_t id = s.shape ? number_of(*s.shape) : 0;
      fields(v, id);
      fields(v, const_cast<Pose&>(s.placement));
    }
  }
  void prepare(Exchange& e, Remote&) {
    for (const PlacedShape& s : *value)
      if (Remote* r = s.shape ? remote_of(*s.shape) : nullptr) e.also.push_back(r);
  }
  void answered(Reader&) {}
};

// --- proxies ---

namespace {

#define RMP_PROXY(T)                                             \
  explicit Proxy(std::shared_ptr<Remote> r, Facts<T> facts = {}) \
      : Proxied(std::move(r)), facts_(std::move(facts)) {}

template <>
class Proxy<PlanQuestions> final : public PlanQuestions, public Proxied {
 public:
  explicit Proxy(std::shared_ptr<Remote> r, Facts<PlanQuestions> = {})
      : PlanQuestions(none()), Proxied(std::move(r)) {}

 private:
  static const PlanProblem& none() {
    static const PlanProblem nothing;
    return nothing;
  }
};
template <>
class Proxy<ClearanceField> final : public ClearanceField, public Proxied {
 public:
  RMP_PROXY(ClearanceField)
  double distance(std::span<const double> q, std::span<double> gradient) const override {
    return call<&ClearanceField::distance>(remote_, q, gradient);
  }

 private:
  Facts<ClearanceField> facts_;
};

template <>
class Proxy<IkSolver> final : public IkSolver, public Proxied, private IkBranches {
 public:
  RMP_PROXY(IkSolver)
  [[nodiscard]] const void* extension(const char* id) const override {
    if (!id || std::string_view(id) != IkBranches::kExtensionId || !has_branches_) return nullptr;
    return static_cast<const IkBranches*>(this);
  }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    has_branches_ = false;
    branches_.clear();
    RMP_TRY(bind<&IkSolver::prepare>(remote_, model, params));
    for (std::int32_t tip = 0; tip < static_cast<std::int32_t>(model.tips.size()); ++tip) {
      auto names = call<&ik_branches>(remote_, tip);
      if (!names.ok() && names.error().code == ErrorCode::unsupported) return {};
      if (!names.ok()) return std::move(names).error();
      Tip& t = branches_.emplace_back();
      t.names = std::move(*names);
      for (const auto& words : t.names) {
        if (words.size() != 3) return error(ErrorCode::plugin_failed, "it named half a branch");
        t.choices.push_back({words[0].c_str(), words[1].c_str(), words[2].c_str(), {}});
      }
    }
    has_branches_ = true;
    return {};
  }
  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    return call<&IkSolver::solve>(remote_, batch, results, progress);
  }

 private:
  struct Tip {
    BranchNames names;
    std::vector<IkBranchChoice> choices;
  };
  [[nodiscard]] std::span<const IkBranchChoice> choices(std::int32_t tip) const override {
    if (tip < 0 || static_cast<std::size_t>(tip) >= branches_.size()) return {};
    return branches_[static_cast<std::size_t>(tip)].choices;
  }
  void measure(std::int32_t tip, std::span<const double> q, std::span<double> out) const override {
    const auto done = call<&ik_measure>(remote_, tip, q, out);
    if (!done.ok()) throw std::runtime_error(done.error().sentence());
  }
  Facts<IkSolver> facts_;
  bool has_branches_ = false;
  std::deque<Tip> branches_;
};

template <>
class Proxy<InverseDynamics> final : public InverseDynamics, public Proxied {
 public:
  RMP_PROXY(InverseDynamics)
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(bind<&InverseDynamics::prepare>(remote_, model, params));
    facts_.scratch = call<&InverseDynamics::scratch_size>(remote_);
    return {};
  }
  [[nodiscard]] std::size_t scratch_size() const override { return facts_.scratch; }
  Result<void> torques(const DynamicsBatch& b, std::span<double> tau, Progress& p) const override {
    return call<&InverseDynamics::torques>(remote_, b, tau, p);
  }
  Result<void> inertia(const DynamicsBatch& b, std::span<double> m, Progress& p) const override {
    return call<&InverseDynamics::inertia>(remote_, b, m, p);
  }
  Result<void> derivatives(const DynamicsBatch& b, std::span<double> by_q, std::span<double> by_qd,
                           Progress& p) const override {
    return call<&InverseDynamics::derivatives>(remote_, b, by_q, by_qd, p);
  }
  Result<void> regressor(const DynamicsBatch& b, std::span<double> y, Progress& p) const override {
    return call<&InverseDynamics::regressor>(remote_, b, y, p);
  }
  Result<void> energy(const DynamicsBatch& b, std::span<Energy> out, Progress& p) const override {
    return call<&InverseDynamics::energy>(remote_, b, out, p);
  }

 private:
  Facts<InverseDynamics> facts_;
};

template <>
class Proxy<ForwardDynamics> final : public ForwardDynamics, public Proxied {
 public:
  RMP_PROXY(ForwardDynamics)
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(bind<&ForwardDynamics::prepare>(remote_, model, params));
    scratch_ = call<&ForwardDynamics::scratch_size>(remote_);
    return {};
  }
  [[nodiscard]] std::size_t scratch_size() const override { return scratch_; }
  Result<void> accelerations(const DynamicsBatch& b, std::span<double> qdd,
                             Progress& p) const override {
    return call<&ForwardDynamics::accelerations>(remote_, b, qdd, p);
  }
  Result<void> constrained(const DynamicsBatch& b, std::span<double> qdd, std::span<double> forces,
                           Progress& p) const override {
    return call<&ForwardDynamics::constrained>(remote_, b, qdd, forces, p);
  }
  Result<void> derivatives(const DynamicsBatch& b, std::span<double> by_q, std::span<double> by_qd,
                           std::span<double> by_tau, Progress& p) const override {
    return call<&ForwardDynamics::derivatives>(remote_, b, by_q, by_qd, by_tau, p);
  }

 private:
  Facts<ForwardDynamics> facts_;
  std::size_t scratch_ = 0;
};

template <>
class Proxy<Controller> final : public Controller, public Proxied {
 public:
  RMP_PROXY(Controller)
  Result<void> prepare(const RobotModel& model, const InverseDynamics& dynamics,
                       const Params& params) override {
    RMP_TRY(bind<&Controller::prepare>(remote_, model, dynamics, params));
    state_ = call<&Controller::state_size>(remote_);
    scratch_ = call<&Controller::scratch_size>(remote_);
    return {};
  }
  [[nodiscard]] std::size_t state_size() const override { return state_; }
  [[nodiscard]] std::size_t scratch_size() const override { return scratch_; }
  Result<void> torques(const ControlInput& in, std::span<double> state, std::span<double> scratch,
                       std::span<double> tau) const override {
    return call<&Controller::torques>(remote_, in, state, scratch, tau);
  }

 private:
  Facts<Controller> facts_;
  std::size_t state_ = 0, scratch_ = 0;
};

template <>
class Proxy<RobotCodeGenerator> final : public RobotCodeGenerator, public Proxied {
 public:
  RMP_PROXY(RobotCodeGenerator)
  Result<std::vector<CodeFile>> generate(const RobotModel& model, std::string_view name,
                                         std::uint32_t parts, const Params& params,
                                         Progress& progress) const override {
    return call<&RobotCodeGenerator::generate>(remote_, model, name, parts, params, progress);
  }

 private:
  Facts<RobotCodeGenerator> facts_;
};

template <>
class Proxy<CurveFactory> final : public CurveFactory, public Proxied {
 public:
  RMP_PROXY(CurveFactory)
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& params) const override {
    return apart::make<&CurveFactory::make, Curve>(remote_, points, params);
  }

 private:
  Facts<CurveFactory> facts_;
};
template <>
class Proxy<Curve> final : public Curve, public Proxied {
 public:
  RMP_PROXY(Curve)
  [[nodiscard]] double end() const override { return facts_.end; }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    return call<&Curve::evaluate>(remote_, u, out);
  }
  [[nodiscard]] std::vector<double> knots() const override { return facts_.knots; }
  [[nodiscard]] bool is_timed() const override { return facts_.is_timed; }
  [[nodiscard]] bool is_even() const override { return facts_.is_even; }

 private:
  Facts<Curve> facts_;
};

template <>
class Proxy<MotionLawFactory> final : public MotionLawFactory, public Proxied {
 public:
  RMP_PROXY(MotionLawFactory)
  Result<std::unique_ptr<MotionLaw>> make(const LawTask& task,
                                          const Params& params) const override {
    return apart::make<&MotionLawFactory::make, MotionLaw>(remote_, task, params);
  }

 private:
  Facts<MotionLawFactory> facts_;
};
template <>
class Proxy<MotionLaw> final : public MotionLaw, public Proxied {
 public:
  RMP_PROXY(MotionLaw)
  [[nodiscard]] double duration() const override { return facts_.duration; }
  Result<void> sample(std::span<const double> times, std::span<LawSample> out) const override {
    return call<&MotionLaw::sample>(remote_, times, out);
  }

 private:
  Facts<MotionLaw> facts_;
};

template <>
class Proxy<OrientationFactory> final : public OrientationFactory, public Proxied {
 public:
  RMP_PROXY(OrientationFactory)
  Result<std::unique_ptr<Orientation>> make(const OrientationTask& task,
                                            const Params& params) const override {
    return apart::make<&OrientationFactory::make, Orientation>(remote_, task, params);
  }

 private:
  Facts<OrientationFactory> facts_;
};
template <>
class Proxy<Orientation> final : public Orientation, public Proxied {
 public:
  RMP_PROXY(Orientation)
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample> along,
                        std::span<OrientationSample> out) const override {
    return call<&Orientation::evaluate>(remote_, w, along, out);
  }

 private:
  Facts<Orientation> facts_;
};

template <>
class Proxy<JointSegmentFactory> final : public JointSegmentFactory, public Proxied {
 public:
  RMP_PROXY(JointSegmentFactory)
  Result<std::unique_ptr<JointSegment>> make(std::size_t dof, std::span<const double> points,
                                             const JointLimits& limits, const JointEnds& ends,
                                             const Params& params) const override {
    return apart::make<&JointSegmentFactory::make, JointSegment>(remote_, dof, points, limits, ends,
                                                                 params);
  }

 private:
  Facts<JointSegmentFactory> facts_;
};
template <>
class Proxy<JointSegment> final : public JointSegment, public Proxied {
 public:
  RMP_PROXY(JointSegment)
  [[nodiscard]] double duration() const override { return facts_.duration; }
  Result<void> sample(std::span<const double> times, const JointSamples& out) const override {
    return call<&JointSegment::sample>(remote_, times, out);
  }

 private:
  Facts<JointSegment> facts_;
};

template <>
class Proxy<SegmentFactory> final : public SegmentFactory, public Proxied {
 public:
  RMP_PROXY(SegmentFactory)
  Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                        const Params& params) const override {
    return apart::make<&SegmentFactory::make, Segment>(remote_, points, params);
  }

 private:
  Facts<SegmentFactory> facts_;
};
template <>
class Proxy<Segment> final : public Segment, public Proxied {
 public:
  RMP_PROXY(Segment)
  [[nodiscard]] double duration() const override { return facts_.duration; }
  [[nodiscard]] double length() const override { return facts_.length; }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    return call<&Segment::sample>(remote_, times, out);
  }

 private:
  Facts<Segment> facts_;
};

template <>
class Proxy<Retimer> final : public Retimer, public Proxied {
 public:
  RMP_PROXY(Retimer)
  Result<Retiming> retime(const RetimeProblem& problem, const Params& params,
                          Progress& progress) const override {
    return call<&Retimer::retime>(remote_, problem, params, progress);
  }

 private:
  Facts<Retimer> facts_;
};

template <>
class Proxy<Integrator> final : public Integrator, public Proxied {
 public:
  RMP_PROXY(Integrator)
  Result<void> prepare(const Params& params) override {
    return bind<&Integrator::prepare>(remote_, params);
  }
  Result<OdeStatistics> run(OdeSystem& system, const OdeRun& run, OdeSink& sink,
                            Progress& progress) const override {
    return call<&Integrator::run>(remote_, system, run, sink, progress);
  }

 private:
  Facts<Integrator> facts_;
};
template <>
class Proxy<OdeSystem> final : public OdeSystem, public Proxied {
 public:
  RMP_PROXY(OdeSystem)
  [[nodiscard]] std::size_t size() const override { return facts_.size; }
  [[nodiscard]] std::size_t positions() const override { return facts_.positions; }
  Result<void> rate(double t, std::span<const double> x, std::span<double> dx) override {
    return call<&OdeSystem::rate>(remote_, t, x, dx);
  }
  void project(std::span<double> x) override { call<&OdeSystem::project>(remote_, x); }
  [[nodiscard]] std::size_t events() const override { return facts_.events; }
  void event_values(double t, std::span<const double> x, std::span<double> g) override {
    call<&OdeSystem::event_values>(remote_, t, x, g);
  }
  bool at_event(double t, std::size_t index, std::span<double> x) override {
    return call<&OdeSystem::at_event>(remote_, t, index, x);
  }

 private:
  Facts<OdeSystem> facts_;
};
template <>
class Proxy<OdeSink> final : public OdeSink, public Proxied {
 public:
  RMP_PROXY(OdeSink)
  bool sample(double t, std::span<const double> x) override {
    return call<&OdeSink::sample>(remote_, t, x);
  }

 private:
  Facts<OdeSink> facts_;
};

template <>
class Proxy<CollisionEngine> final : public CollisionEngine, public Proxied {
 public:
  RMP_PROXY(CollisionEngine)
  Result<std::unique_ptr<CollisionScene>> build(std::span<const ShapedBody> bodies,
                                                const Params& params,
                                                Progress& progress) const override {
    return apart::make<&CollisionEngine::build, CollisionScene>(remote_, bodies, params, progress);
  }

 private:
  Facts<CollisionEngine> facts_;
};
template <>
class Proxy<CollisionScene> final : public CollisionScene, public Proxied, private CollisionBounds {
 public:
  RMP_PROXY(CollisionScene)
  [[nodiscard]] const void* extension(const char* id) const override {
    if (!id || std::string_view(id) != CollisionBounds::kId || !facts_.has_bounds) return nullptr;
    return static_cast<const CollisionBounds*>(this);
  }
  Result<void> distances(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                         double interest, std::span<PairDistance> out,
                         Progress& progress) const override {
    return call<&CollisionScene::distances>(remote_, poses, pairs, interest, out, progress);
  }
  Result<void> collisions(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                          std::span<std::uint8_t> out, Progress& progress) const override {
    return call<&CollisionScene::collisions>(remote_, poses, pairs, out, progress);
  }

 private:
  Result<void> lower_bounds(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                            double interest, double tolerance, std::span<PairDistance> out,
                            Progress& progress) const override {
    return call<&apart::lower_bounds>(remote_, poses, pairs, interest, tolerance, out, progress);
  }
  Facts<CollisionScene> facts_;
};

template <>
class Proxy<PhysicsEngine> final : public PhysicsEngine, public Proxied {
 public:
  RMP_PROXY(PhysicsEngine)
  Result<std::unique_ptr<PhysicsWorld>> create(std::span<const PhysicsBody> bodies,
                                               std::span<const PhysicsJoint> joints, Vec3 gravity,
                                               const Params& params) const override {
    auto made = call<&PhysicsEngine::create>(remote_, bodies, joints, gravity, params);
    if (made.ok() && *made)
      dynamic_cast<Proxied&>(**made).remote()->lost =
          "the bodies that it moved ended with its process";
    return made;
  }

 private:
  Facts<PhysicsEngine> facts_;
};
template <>
class Proxy<PhysicsWorld> final : public PhysicsWorld, public Proxied, private PhysicsNotes {
 public:
  RMP_PROXY(PhysicsWorld)
  [[nodiscard]] const void* extension(const char* id) const override {
    if (!id || std::string_view(id) != PhysicsNotes::kId || !facts_.has_notes) return nullptr;
    return static_cast<const PhysicsNotes*>(this);
  }
  Result<void> step(double dt, std::int32_t steps, std::span<const double> forces,
                    Progress& progress) override {
    return call<&PhysicsWorld::step>(remote_, dt, steps, forces, progress);
  }
  Result<void> read(const PhysicsState& out) const override {
    return call<&PhysicsWorld::read>(remote_, out);
  }
  void contacts(std::vector<PhysicsContact>& out) const override {
    call<&PhysicsWorld::contacts>(remote_, out);
  }
  Result<std::int32_t> attach(std::int32_t a, std::int32_t b) override {
    return call<&PhysicsWorld::attach>(remote_, a, b);
  }
  Result<void> release(std::int32_t attachment) override {
    return call<&PhysicsWorld::release>(remote_, attachment);
  }
  Result<void> move(std::int32_t body, const Pose& pose, Vec3 velocity,
                    Vec3 angular_velocity) override {
    return call<&PhysicsWorld::move>(remote_, body, pose, velocity, angular_velocity);
  }
  Result<void> servo(std::int32_t joint, double velocity, double force) override {
    return call<&PhysicsWorld::servo>(remote_, joint, velocity, force);
  }
  Result<void> push(std::int32_t body, Vec3 force, Vec3 torque) override {
    return call<&PhysicsWorld::push>(remote_, body, force, torque);
  }
  Result<void> ignore(std::int32_t a, std::int32_t b) override {
    return call<&PhysicsWorld::ignore>(remote_, a, b);
  }

 private:
  [[nodiscard]] Result<std::vector<PhysicsNote>> notes() const override {
    return call<&apart::physics_notes>(remote_);
  }
  Facts<PhysicsWorld> facts_;
};

Result<Plan> plan_by(const Planner& planner, const PlanWire& wire, const Params& params,
                     Progress& progress) {
  PlanProblem problem = wire.problem;
  if (wire.questions) {
    const auto& asked = *static_cast<const Proxy<PlanQuestions>*>(wire.questions);
    problem.is_free = [&asked](std::span<const double> q) {
      return call<&PlanQuestions::is_free>(asked.remote(), q);
    };
    problem.is_free_between = [&asked](std::span<const double> a, std::span<const double> b) {
      return call<&PlanQuestions::is_free_between>(asked.remote(), a, b);
    };
  }
  return planner.plan(problem, params, progress);
}
template <>
class Proxy<Planner> final : public Planner, public Proxied {
 public:
  RMP_PROXY(Planner)
  Result<Plan> plan(const PlanProblem& problem, const Params& params,
                    Progress& progress) const override {
    const PlanQuestions questions(problem);
    const PlanWire wire{problem, &questions};
    return call<&plan_by>(remote_, wire, params, progress);
  }

 private:
  Facts<Planner> facts_;
};

template <>
class Proxy<Importer> final : public Importer, public Proxied {
 public:
  explicit Proxy(std::shared_ptr<Remote> r)
      : Proxied(std::move(r)), extensions_(call<&importer_extensions>(remote_)) {}
  [[nodiscard]] std::string_view extensions() const override { return extensions_; }
  Result<Imported> read(std::string_view path, const Params& params,
                        Progress& progress) const override {
    return call<&Importer::read>(remote_, path, params, progress);
  }

 private:
  std::string extensions_;
};
template <>
class Proxy<Exporter> final : public Exporter, public Proxied {
 public:
  explicit Proxy(std::shared_ptr<Remote> r)
      : Proxied(std::move(r)), extensions_(call<&exporter_extensions>(remote_)) {
    std::vector<std::string> all;
    for (const std::string_view word : text::split(extensions_, ','))
      all.emplace_back(text::trim(word));
    exact_ = call<&exact_extensions>(remote_, all);
  }
  [[nodiscard]] std::string_view extensions() const override { return extensions_; }
  [[nodiscard]] bool is_exact(std::string_view extension) const override {
    return std::find(exact_.begin(), exact_.end(), extension) != exact_.end();
  }
  Result<std::vector<ExportedFile>> write(const ExportTask& task, const Params& params,
                                          Progress& progress) const override {
    return call<&Exporter::write>(remote_, task, params, progress);
  }

 private:
  std::string extensions_;
  std::vector<std::string> exact_;
};

template <>
class Proxy<CsgPrimitive> final : public CsgPrimitive, public Proxied {
 public:
  RMP_PROXY(CsgPrimitive)
  Result<CsgTree> build(const Params& params, Progress& progress) const override {
    return call<&CsgPrimitive::build>(remote_, params, progress);
  }

 private:
  Facts<CsgPrimitive> facts_;
};

template <>
class Proxy<CsgShape> final : public CsgShape, public Proxied {
 public:
  RMP_PROXY(CsgShape)
  [[nodiscard]] std::array<Vec3, 2> bounds() const override { return facts_.bounds; }
  [[nodiscard]] std::span<const std::string> notes() const override { return facts_.notes; }

 private:
  Facts<CsgShape> facts_;
};
Remote* remote_of(const CsgShape& shape) {
  const auto* proxy = dynamic_cast<const Proxy<CsgShape>*>(&shape);
  return proxy ? proxy->remote().get() : nullptr;
}
std::uint64_t number_of(const CsgShape& shape) {
  Remote* r = remote_of(shape);
  if (!r) return 0;
  const std::lock_guard lock(r->mutex);
  return r->id;
}

template <>
class Proxy<CsgEngine> final : public CsgEngine, public Proxied, private CsgEdges {
 public:
  explicit Proxy(std::shared_ptr<Remote> r)
      : Proxied(std::move(r)), has_edges_(call<&apart::has_edges>(remote_)) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    if (!id || std::string_view(id) != CsgEdges::kExtensionId || !has_edges_) return nullptr;
    return static_cast<const CsgEdges*>(this);
  }
  Result<std::shared_ptr<const CsgShape>> evaluate(const CsgTree& tree,
                                                   Progress& progress) const override {
    std::string bytes;
    RMP_TRY_ASSIGN(std::shared_ptr<const CsgShape> made,
                   call_with<&CsgEngine::evaluate>(remote_, CallOptions{false, &bytes, nullptr},
                                                   tree, progress));
    if (made) static_cast<const Proxy<CsgShape>&>(*made).remote()->make_bytes = std::move(bytes);
    return made;
  }
  Result<Mesh> mesh(const CsgShape& shape, const MeshQuality& quality,
                    Progress& progress) const override {
    return call<&CsgEngine::mesh>(remote_, shape, quality, progress);
  }
  Result<Moments> moments(const CsgShape& shape, Progress& progress) const override {
    return call<&CsgEngine::moments>(remote_, shape, progress);
  }
  Result<Partition> partition(std::span<const PlacedShape> parts,
                              Progress& progress) const override {
    return call<&CsgEngine::partition>(remote_, parts, progress);
  }
  Result<std::vector<CsgFeature>> features(const CsgShape& shape,
                                           Progress& progress) const override {
    return call<&CsgEngine::features>(remote_, shape, progress);
  }
  Result<CsgProfile> section(const CsgShape& shape, const Pose& plane, double chord,
                             Progress& progress) const override {
    return call<&CsgEngine::section>(remote_, shape, plane, chord, progress);
  }
  Result<CsgGeometry> geometry(const CsgShape& shape, Progress& progress) const override {
    return call<&CsgEngine::geometry>(remote_, shape, progress);
  }

 private:
  Result<std::vector<CsgEdge>> edges(const CsgShape& shape, double chord,
                                     Progress& progress) const override {
    return call<&csg_edges>(remote_, shape, chord, progress);
  }
  bool has_edges_;
};

template <>
class Proxy<Module> final : public Module, public Proxied {
 public:
  explicit Proxy(std::shared_ptr<Remote> r) : Proxied(std::move(r)) {
    auto read = call<&module_table>(remote_);
    if (!read.ok()) throw std::runtime_error(read.error().sentence());
    wire_ = std::move(*read);
    if (wire_.commands.size() > kMostCommands) throw std::runtime_error("it has too many commands");
    for (const CommandWire& c : wire_.commands) {
      ModuleCommand& row = commands_.emplace_back();
      row.name = c.name.c_str();
      row.summary = c.summary.c_str();
      row.details = c.details.c_str();
      row.example = c.example.c_str();
      row.effects = c.effects.c_str();
      row.sometimes = c.sometimes.c_str();
      row.params = table_of(c.params);
      row.result_type = c.result_type.c_str();
      row.result_unit = c.result_unit.c_str();
      row.result_doc = c.result_doc.c_str();
      row.result_fields = table_of(c.result_fields);
      row.run = runner(commands_.size() - 1);
    }
    table_.commands = commands_.data();
    table_.command_count = static_cast<std::uint32_t>(commands_.size());
    table_.settings = table_of(wire_.settings);
    table_.runs = wire_.runs;
  }
  [[nodiscard]] const ModuleTable& table() const override { return table_; }
  Result<void> before_run(const ModuleRunNotice& notice, ModuleCall& host) const override {
    return call<&Module::before_run>(remote_, notice, host);
  }
  Result<void> after_run(const ModuleRunNotice& notice, const ModuleRunEnd& end,
                         ModuleCall& host) const override {
    return call<&Module::after_run>(remote_, notice, end, host);
  }

 private:
  using Run = Result<ModuleValue> (*)(const Module&, const ModuleValue&, ModuleCall&);
  template <std::size_t I>
  static Result<ModuleValue> run_one(const Module& module, const ModuleValue& arguments,
                                     ModuleCall& host) {
    std::uint32_t index = I;
    return call<&module_run>(static_cast<const Proxy&>(module).remote_, index, arguments, host);
  }
  /// Functions of commands get no context: one for each number.
  static Run runner(std::size_t i) {
    static constexpr auto all = []<std::size_t... I>(std::index_sequence<I...>) {
      return std::array<Run, sizeof...(I)>{&run_one<I>...};
    }
    (std::make_index_sequence<kMostCommands>());
    return all.at(i);
  }
  ModuleFields table_of(const std::vector<RowWire>& rows) {
    auto& own = rows_.emplace_back();
    for (const RowWire& w : rows)
      own.push_back({w.name.c_str(), w.type.c_str(), w.unit.c_str(), w.doc.c_str(),
                     w.default_text ? w.default_text->c_str() : nullptr,
                     w.choices ? w.choices->c_str() : nullptr, w.min, w.max, w.flags,
                     w.label.empty() ? nullptr : w.label.c_str(),
                     w.group.empty() ? nullptr : w.group.c_str()});
    ModuleFields f;
    f.rows = own.data();
    f.count = static_cast<std::uint32_t>(own.size());
    return f;
  }
  ModuleWire wire_;
  std::deque<std::vector<rmp_param>> rows_;
  std::vector<ModuleCommand> commands_;
  ModuleTable table_;
};
template <>
class Proxy<ModuleCall> final : public ModuleCall, public Proxied {
 public:
  RMP_PROXY(ModuleCall)
  Result<ModuleValue> run(std::string_view command, const ModuleValue& arguments) override {
    return call<&ModuleCall::run>(remote_, command, arguments);
  }
  [[nodiscard]] Result<ModuleValue> setting(std::string_view name) const override {
    return call<&ModuleCall::setting>(remote_, name);
  }
  [[nodiscard]] Result<std::string> name(const ModuleValue& reference) const override {
    return call<&ModuleCall::name>(remote_, reference);
  }
  Result<std::shared_ptr<const RobotModel>> robot_model(const ModuleValue& robot) override {
    return call<&ModuleCall::robot_model>(remote_, robot);
  }
  Progress& progress() override { return remote_->peer->progress(); }
  void say(std::int32_t severity, std::string_view words) override {
    call<&ModuleCall::say>(remote_, severity, words);
  }
  [[nodiscard]] std::string_view session() const override { return facts_.session; }

 private:
  Facts<ModuleCall> facts_;
};

#undef RMP_PROXY

template <class I>
InterfaceWire wire_of() {
  return {I::kInterfaceId, &Methods<I>::serve,
          [](std::shared_ptr<Remote> remote) -> Result<void*> {
            const std::string name = remote->name;
            try {
              return static_cast<void*>(static_cast<I*>(new Proxy<I>(std::move(remote))));
            } catch (const std::exception& e) {
              return error(ErrorCode::plugin_failed,
                           "provider \"" + name + "\" could not be made: " + e.what(),
                           "Choose another provider or see the documentation of this one.");
            } catch (...) {
              return error(ErrorCode::plugin_failed,
                           "provider \"" + name + "\" could not be made: it threw",
                           "Choose another provider or see the documentation of this one.");
            }
          },
          [](void* made) -> std::shared_ptr<void> {
            return std::shared_ptr<I>(static_cast<I*>(made));
          }};
}

}  // namespace

void Given<std::shared_ptr<const CsgShape>>::read(Reader& r, std::shared_ptr<const CsgShape>& x,
                                                  const std::shared_ptr<Remote>& maker,
                                                  std::uint32_t method) {
  x = product_read<CsgShape>(r, maker, method);
}

const InterfaceWire* interface_wire(std::string_view interface_id) {
  static const InterfaceWire all[] = {wire_of<IkSolver>(),
                                      wire_of<InverseDynamics>(),
                                      wire_of<ForwardDynamics>(),
                                      wire_of<Controller>(),
                                      wire_of<RobotCodeGenerator>(),
                                      wire_of<CurveFactory>(),
                                      wire_of<MotionLawFactory>(),
                                      wire_of<OrientationFactory>(),
                                      wire_of<JointSegmentFactory>(),
                                      wire_of<SegmentFactory>(),
                                      wire_of<Retimer>(),
                                      wire_of<Integrator>(),
                                      wire_of<CollisionEngine>(),
                                      wire_of<PhysicsEngine>(),
                                      wire_of<Planner>(),
                                      wire_of<Importer>(),
                                      wire_of<Exporter>(),
                                      wire_of<CsgPrimitive>(),
                                      wire_of<CsgEngine>(),
                                      wire_of<Module>()};
  for (const InterfaceWire& w : all)
    if (w.id == interface_id) return &w;
  return nullptr;
}

namespace {

/// Interfaces with providers that run in the program only, and why.
struct InProgram {
  std::string_view id, reason;
};
constexpr InProgram kInProgram[] = {
    {render::Renderer::kInterfaceId,
     "a renderer draws with the display and the graphics card, which a separate process has no "
     "access to"},
    {Language::kInterfaceId,
     "runs read the tables of a compiled program where the compiler made them, and there is no "
     "copy "
     "of them for another process"},
    {Post::kInterfaceId,
     "posts read the tables of a compiled program where the compiler made them, and there is no "
     "copy "
     "of them for another process"},
    {ProgramReader::kInterfaceId,
     "the source files, faults and lines that a reader of programs returns have no form between "
     "processes yet"},
    {TipForce::kInterfaceId,
     "a force at the tip is computed several times in each step of a simulation, and is shorter "
     "than "
     "a call to another process"},
};

}  // namespace

bool runs_in_program_only(std::string_view interface_id) {
  return std::any_of(std::begin(kInProgram), std::end(kInProgram),
                     [interface_id](const InProgram& p) { return p.id == interface_id; });
}

std::string not_apart(std::string_view interface_id) {
  for (const InProgram& p : kInProgram)
    if (p.id == interface_id) return std::string(p.reason);
  return "the interface " + std::string(interface_id) + " has no form between processes";
}

}  // namespace robomosp::apart
