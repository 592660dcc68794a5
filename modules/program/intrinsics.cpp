// SPDX-License-Identifier: Apache-2.0
// Functions and procedures of the language, as they run.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "program/state.h"

namespace robomosp::program {
namespace {

constexpr std::size_t kMostFiles = 1000;

std::string escaped(std::string_view s) {
  std::string out;
  for (const char c : s) {
    if (c == '\\') out += "\\\\";
    else if (c == '\n') out += "\\n";
    else if (c == '\r') out += "\\r";
    else out += c;
  }
  return out;
}
std::string unescaped(std::string_view s) {
  std::string out;
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (s[i] != '\\' || i + 1 == s.size()) out += s[i];
    else {
      ++i;
      out += s[i] == 'n' ? '\n' : s[i] == 'r' ? '\r' : s[i];
    }
  }
  return out;
}
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

}  // namespace

Heap::File* Run::file_of(Process& p, const Place& x) {
  const Slot* s = slots(p, x);
  if (!s || (s->bits & kTagMask) != kFileTag) return nullptr;
  const auto i = static_cast<std::uint32_t>(s->bits);
  return i < s_.heap.files.size() && s_.heap.files[i].mode ? &s_.heap.files[i] : nullptr;
}

Run::Did Run::write(Process& p, const IntrinsicCall& c) {
  const bool ends = c.fn == Fn::writeln;
  const bool has_file =
      !c.arguments.empty() && (c_.types[c.arguments[0].type].kind == RMP_TYPE_TEXT ||
                               c_.types[c.arguments[0].type].kind == RMP_TYPE_FILE);
  const bool is_values = has_file && c_.types[c.arguments[0].type].kind == RMP_TYPE_FILE;
  const std::size_t most = std::size_t{64} << 20;
  std::string out;
  for (std::size_t k = has_file; k < c.arguments.size(); ++k) {
    const Slot* v = slots(p, c.arguments[k]);
    if (!v) return fail("a place of the code does not exist"), Did::failed;
    if (is_values) {
      std::string one;
      append_text(c.arguments[k].type, v, one, most);
      out += escaped(one) + "\n";
    } else {
      append_text(c.arguments[k].type, v, out, most);
    }
    if (out.size() > most)
      return fail("WRITE has more than 67108864 characters", "Write less at once."), Did::failed;
  }
  if (ends && !is_values) out += '\n';
  cost_ += out.size() / 64;
  ++s_.progress;
  if (!has_file) {
    const auto done = world_->write_text(p.routine, out);
    return done.ok() || fail(done.error()) ? Did::done : Did::failed;
  }
  if (!has_room(out.size())) return Did::failed;
  Heap::File* f = file_of(p, c.arguments[0]);
  if (!f || f->mode == 'R')
    return fail(f ? "the file " + f->name + " is open for reading" : "the file is not open",
                "OPEN it with 'W' or 'A' first."),
           Did::failed;
  f->text += out;
  f->span = c_.instruction(at_).span;
  s_.heap.bytes += out.size();
  return Did::done;
}

Run::Did Run::read(Process& p, const IntrinsicCall& c) {
  const bool has_file =
      !c.arguments.empty() && (c_.types[c.arguments[0].type].kind == RMP_TYPE_TEXT ||
                               c_.types[c.arguments[0].type].kind == RMP_TYPE_FILE);
  const bool is_values = has_file && c_.types[c.arguments[0].type].kind == RMP_TYPE_FILE;
  Heap::File* f = nullptr;
  if (has_file) {
    f = file_of(p, c.arguments[0]);
    if (!f || f->mode != 'R')
      return fail(f ? "the file " + f->name + " is open for writing" : "the file is not open",
                  "OPEN it with 'R' first."),
             Did::failed;
  }
  const std::string& text = f ? f->text : p.input;
  std::size_t at_byte = f ? f->at : 0;
  const auto more = [&] {
    if (f) {
      fail("the file " + f->name + " has reached its end", "Ask EOF first.");
      return Did::failed;
    }
    p.wait = {};
    p.wait.kind = Waits::line;
    return Did::waits;
  };
  // Values are put down only when all of them are there: a wait begins this again.
  std::vector<Slot> values;
  for (std::size_t k = has_file; k < c.arguments.size(); ++k) {
    const std::uint32_t kind = c_.types[c.arguments[k].type].kind;
    std::string word;
    if (is_values) {
      const std::size_t end = text.find('\n', at_byte);
      if (end == std::string::npos) return more();
      word = unescaped(std::string_view(text).substr(at_byte, end - at_byte));
      at_byte = end + 1;
    } else if (kind == RMP_TYPE_STRING) {
      if (at_byte >= text.size()) return more();
      const std::size_t end = std::min(text.find('\n', at_byte), text.size());
      word = text.substr(at_byte, end - at_byte);
      if (!word.empty() && word.back() == '\r') word.pop_back();
      at_byte = end;
    } else if (kind == RMP_TYPE_CHAR) {
      while (at_byte < text.size() && (text[at_byte] == '\n' || text[at_byte] == '\r')) ++at_byte;
      if (at_byte >= text.size()) return more();
      word = text[at_byte++];
    } else {
      while (at_byte < text.size() && is_blank(text[at_byte])) ++at_byte;
      if (at_byte >= text.size()) return more();
      const std::size_t begin = at_byte;
      while (at_byte < text.size() && !is_blank(text[at_byte]) && text[at_byte] != ',') ++at_byte;
      word = text.substr(begin, at_byte - begin);
      if (at_byte < text.size() && text[at_byte] == ',') ++at_byte;
    }
    const auto wrong = [&](const char* what) {
      // What was typed is gone, so that the next READ does not stumble over it again.
      if (!f) p.input.clear();
      fail("\"" + word.substr(0, 60) + "\" was read, which is not " + what);
      return Did::failed;
    };
    const char* end = word.data() + word.size();
    if (kind == RMP_TYPE_INT) {
      std::int32_t v = 0;
      const auto r = std::from_chars(word.data() + (word.size() > 1 && word[0] == '+'), end, v);
      if (r.ec != std::errc() || r.ptr != end) return wrong("INT");
      values.push_back(Slot::of(v));
    } else if (kind == RMP_TYPE_REAL) {
      double v = 0;
      const auto r = std::from_chars(word.data() + (word.size() > 1 && word[0] == '+'), end, v);
      if (r.ec != std::errc() || r.ptr != end || !std::isfinite(v)) return wrong("REAL");
      values.push_back(Slot::of_real(v));
    } else if (kind == RMP_TYPE_BOOL) {
      std::string up = word;
      for (char& x : up)
        if (x >= 'a' && x <= 'z') x = static_cast<char>(x - 32);
      if (up != "TRUE" && up != "FALSE" && up != "1" && up != "0") return wrong("BOOL");
      values.push_back(Slot::of(up == "TRUE" || up == "1"));
    } else if (kind == RMP_TYPE_CHAR) {
      if (word.size() != 1) return wrong("CHAR");
      values.push_back(Slot::of(static_cast<unsigned char>(word[0])));
    } else {
      if (!has_room(word.size() + 64)) return Did::failed;
      values.push_back(new_text(std::move(word)));
    }
  }
  if (c.fn == Fn::readln && !is_values) {
    const std::size_t end = text.find('\n', at_byte);
    if (end == std::string::npos) {
      if (!f && c.arguments.empty()) return more();
      at_byte = text.size();
    } else {
      at_byte = end + 1;
    }
  }
  for (std::size_t k = has_file, i = 0; k < c.arguments.size(); ++k, ++i) {
    const Place& x = c.arguments[k];
    if (x.type == RMP_TYPE_CHAR && x.is_reference) {
      const Slot* ref = p.stack.data() + p.frames.back().base + x.offset;
      if (ref[1].bits) {
        Slot* s = at(p, ref[0].bits, 1, true);
        if (!s) return fail("a place of the code does not exist"), Did::failed;
        std::string changed(text_of(*s));
        if (ref[1].bits > changed.size()) return fail("the string has become shorter"), Did::failed;
        changed[ref[1].bits - 1] = static_cast<char>(values[i].integer());
        const Slot made = new_text(std::move(changed));
        *at(p, ref[0].bits, 1, true) = made;
        continue;
      }
    }
    Slot* s = x.is_reference
                  ? at(p, (p.stack.data() + p.frames.back().base + x.offset)->bits, 1, true)
                  : slots(p, x);
    if (!s) return fail("a place of the code does not exist"), Did::failed;
    *s = values[i];
  }
  ++s_.progress;
  if (f) {
    if ((f = file_of(p, c.arguments[0]))) f->at = at_byte;
  } else {
    p.input.erase(0, at_byte);
  }
  return Did::done;
}

Run::Did Run::intrinsic(Process& p, const IntrinsicCall& c) {
  const auto failed = [&](std::string message, std::string hint = {}) {
    fail(std::move(message), std::move(hint));
    return Did::failed;
  };
  const auto name = [&] { return std::string(c_.symbol(c.symbol).name); };
  const Slot* in[4] = {};
  for (std::size_t k = 0; k < c.arguments.size() && k < 4; ++k) {
    in[k] = slots(p, c.arguments[k]);
    if (!in[k]) return failed("a place of the code does not exist", "Compile the program again.");
  }
  const auto out = [&] { return slots(p, c.result); };
  const auto number = [&](std::size_t k) { return in[k]->real(); };
  const auto whole = [&](std::int64_t v) {
    if (v > std::numeric_limits<std::int32_t>::max() ||
        v < std::numeric_limits<std::int32_t>::min())
      return failed("the value of " + name() + " is outside the range of INT",
                    "An INT is from -2147483648 to 2147483647.");
    *out() = Slot::of(v);
    return Did::done;
  };
  const auto reals = [&](const double* v, std::size_t n) {
    for (std::size_t k = 0; k < n; ++k)
      if (!std::isfinite(v[k]))
        return failed("the value of " + name() + " is outside the range of REAL");
    Slot* to = out();
    for (std::size_t k = 0; k < n; ++k) to[k] = Slot::of_real(v[k]);
    return Did::done;
  };
  const auto get = [&](std::size_t k, double* v, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) v[i] = in[k][i].real();
  };
  // Orientations are used as rotations, so they have length one.
  const auto turned = [&](std::size_t k, double* q) {
    get(k, q, 4);
    const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(std::fabs(n - 1) < 1e-3)) {
      fail("the orientation that " + name() + " gets is not a unit quaternion: its length is " +
               real_literal(n),
           "Create it with a function such as ORIQUAT or ORIZYX.");
      return false;
    }
    for (int i = 0; i < 4; ++i) q[i] /= n;
    return true;
  };
  const auto asks = [&] {  // what has its place behind the motions
    return must_wait(p);
  };
  if (c.fn >= Fn::open && c.fn <= Fn::release && p.condition_depth)
    return failed("a condition of UNTIL or WHEN calls " + name(),
                  "Functions called there may only compute.");
  double q[4], v[3], w[3], r[7];
  switch (c.fn) {
    case Fn::number: {
      const double x[2] = {number(0), c.arguments.size() > 1 ? number(1) : 0.0};
      const auto y = number_value(c.number, std::span(x, c.arguments.size()));
      if (!y || std::fabs(*y) > 4e9) {
        if (!y) return failed(name() + " has no value at " + real_literal(x[0]));
        return whole(std::numeric_limits<std::int64_t>::max());
      }
      return whole(static_cast<std::int64_t>(*y));
    }
    case Fn::abs_int: {
      const std::int64_t x = in[0]->integer();
      return whole(x < 0 ? -x : x);
    }
    case Fn::size_of: {
      const TypeInfo& t = c_.types[c.arguments[0].type];
      if (t.kind == RMP_TYPE_ARRAY) return whole(t.length);
      if (t.kind == RMP_TYPE_STRING)
        return whole(static_cast<std::int64_t>(text_of(*in[0]).size()));
      const Heap::List* l = list_of(*in[0]);
      return whole(
          l && t.element_slots ? static_cast<std::int64_t>(l->slots.size() / t.element_slots) : 0);
    }
    case Fn::cross:
      get(0, v, 3);
      get(1, w, 3);
      r[0] = v[1] * w[2] - v[2] * w[1];
      r[1] = v[2] * w[0] - v[0] * w[2];
      r[2] = v[0] * w[1] - v[1] * w[0];
      return reals(r, 3);
    case Fn::dot:
      get(0, v, 3);
      get(1, w, 3);
      r[0] = v[0] * w[0] + v[1] * w[1] + v[2] * w[2];
      return reals(r, 1);
    case Fn::ori_xyz:
    case Fn::ori_yxz:
    case Fn::ori_zyx:
    case Fn::ori_zyz2:
    case Fn::ori_rs: {
      static constexpr int kAxes[5][3] = {{0, 1, 2}, {1, 0, 2}, {2, 1, 0}, {2, 1, 2}, {2, 1, 0}};
      const auto form = static_cast<std::size_t>(c.fn) - static_cast<std::size_t>(Fn::ori_xyz);
      double angles[3] = {number(0), number(1), number(2)};
      if (c.fn == Fn::ori_rs) std::swap(angles[0], angles[2]);
      three_rotations(kAxes[form], angles, q);
      return reals(q, 4);
    }
    case Fn::ori_vang: {
      get(0, v, 3);
      const double n = std::hypot(v[0], v[1], v[2]);
      if (!(n > 0) || !std::isfinite(n))
        return failed("ORIVANG gets an axis without a direction",
                      "Such as POSITION(0.0, 0.0, 1.0).");
      axis_rotation(0, number(1), q);
      const double s = q[1];
      for (int k = 0; k < 3; ++k) q[1 + k] = s * (v[k] / n);
      return reals(q, 4);
    }
    case Fn::ori_quat: {
      double most = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        q[k] = number(k);
        most = std::max(most, std::fabs(q[k]));
      }
      if (!(most > 0)) return failed("ORIQUAT gets four zeros, which are not an orientation");
      for (double& x : q) x /= most;
      const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
      for (double& x : q) x /= n;
      return reals(q, 4);
    }
    case Fn::ori_mat: {
      double a[3];
      get(0, v, 3);
      get(1, w, 3);
      get(2, a, 3);
      if (!columns_to_quaternion(v, w, a, q))
        return failed(
            "ORIMAT gets axes that are not of length one, at right angles and right-handed");
      return reals(q, 4);
    }
    case Fn::ori_mult: {
      double a[4], b[4];
      get(0, a, 4);
      get(1, b, 4);
      compose_orientations(a, b, q);
      return reals(q, 4);
    }
    case Fn::angle_x:
    case Fn::angle_y:
    case Fn::angle_z:
    case Fn::angle_z2: {
      if (!turned(1, q)) return Did::failed;
      double angles[4];
      unsigned has = 0;
      const std::string mode(text_of(*in[0]));
      const auto which = static_cast<unsigned>(c.fn) - static_cast<unsigned>(Fn::angle_x);
      if (!angles_of(mode, q, angles, has))
        return failed(name() + " has no mode '" + mode.substr(0, 40) + "'",
                      "Modes are 'RS', 'XYZ', 'YXZ', 'ZYX' and 'ZYZ2'.");
      if (!(has >> which & 1u)) return failed("the mode '" + mode + "' has no angle of " + name());
      return reals(angles + which, 1);
    }
    case Fn::quat_a:
    case Fn::quat_b:
    case Fn::quat_c:
    case Fn::quat_d:
      *out() = in[0][static_cast<std::size_t>(c.fn) - static_cast<std::size_t>(Fn::quat_a)];
      return Did::done;
    case Fn::rot_angle:
      if (!turned(0, q)) return Did::failed;
      r[0] = 2 * std::atan2(std::hypot(q[1], q[2], q[3]), std::fabs(q[0])) * kDegreesPerRadian;
      return reals(r, 1);
    case Fn::rot_axis: {
      if (!turned(0, q)) return Did::failed;
      const double n = std::hypot(q[1], q[2], q[3]);
      if (n < 1e-12)
        return failed("ROTAXIS has no value: the orientation has no rotation",
                      "Ask ROTANGLE first.");
      for (int k = 0; k < 3; ++k) r[k] = (q[0] < 0 ? -q[1 + k] : q[1 + k]) / n;
      return reals(r, 3);
    }
    case Fn::vector_n:
    case Fn::vector_o:
    case Fn::vector_a: {
      if (!turned(0, q)) return Did::failed;
      double m[9];
      quaternion_to_matrix(q, m);
      const std::size_t k = static_cast<std::size_t>(c.fn) - static_cast<std::size_t>(Fn::vector_n);
      r[0] = m[k];
      r[1] = m[3 + k];
      r[2] = m[6 + k];
      return reals(r, 3);
    }
    case Fn::inv: {
      const PlainPose i = inverse_pose(pose_of(in[0]));
      for (std::size_t k = 0; k < 3; ++k) r[k] = i.position[k];
      for (std::size_t k = 0; k < 4; ++k) r[3 + k] = i.quaternion[k];
      return reals(r, 7);
    }
    case Fn::trafo:
    case Fn::trafo_inv: {
      const Target t = target_of(c.arguments[0].type, in[0]);
      auto made = c.fn == Fn::trafo ? world_->forward(t, p.routine) : world_->inverse(t, p.routine);
      if (!made.ok()) return fail(made.error()), Did::failed;
      cost_ += 100;
      return put_target(c.result.type, *made, out()) ? Did::done : Did::failed;
    }
    case Fn::for_step:
      if (in[0]->integer() == 0)
        return failed("STEP of the FOR is 0, so the loop would never end",
                      "A positive STEP counts upwards, a negative one downwards.");
      *out() = *in[0];
      return Did::done;
    case Fn::robot_joints:
    case Fn::robot_target: {
      if (must_wait(p)) return Did::waits;
      const auto now = world_->robot_state(p.robot, p.routine);
      if (!now.ok()) return fail(now.error()), Did::failed;
      cost_ += 100;
      return put_target(c.result.type, *now, out()) ? Did::done : Did::failed;
    }
    case Fn::robot_flange: {
      if (must_wait(p)) return Did::waits;
      const auto now = world_->robot_flange(p.robot, p.routine);
      if (!now.ok()) return fail(now.error()), Did::failed;
      cost_ += 100;
      for (std::size_t k = 0; k < 3; ++k) r[k] = now->position[k];
      for (std::size_t k = 0; k < 4; ++k) r[3 + k] = now->quaternion[k];
      return reals(r, 7);
    }
    case Fn::robot_speed: {
      if (must_wait(p)) return Did::waits;
      const auto speed = world_->robot_speed(p.robot, p.routine);
      if (!speed.ok()) return fail(speed.error()), Did::failed;
      if (!std::isfinite(*speed)) return failed("the speed of the robot is not a finite number");
      *out() = Slot::of_real(*speed);
      return Did::done;
    }
    case Fn::act_robot: return act_robot(p, c);
    case Fn::brake: return brake(p, c, c.arguments.empty() ? 0 : in[0]->integer());
    case Fn::compare: {
      const int x = text_of(*in[0]).compare(text_of(*in[1]));
      return whole(x < 0 ? -1 : x > 0 ? 1 : 0);
    }
    case Fn::length: return whole(static_cast<std::int64_t>(text_of(*in[0]).size()));
    case Fn::locate: {
      const std::string_view s = text_of(*in[0]);
      cost_ += s.size() / 16;
      const std::size_t at_byte = s.find(text_of(*in[1]));
      return whole(at_byte == std::string_view::npos ? 0 : static_cast<std::int64_t>(at_byte) + 1);
    }
    case Fn::concat: {
      const std::size_t n = text_of(*in[0]).size() + text_of(*in[1]).size();
      cost_ += n / 64;
      if (n > 0x7fff'ffff) return failed("the string has more than 2147483647 characters");
      if (!has_room(n + 64)) return Did::failed;
      std::string s(text_of(*in[0]));
      s += text_of(*in[1]);
      const Slot made = new_text(std::move(s));
      *out() = made;
      return Did::done;
    }
    case Fn::extract:
    case Fn::delete_: {
      const std::string_view s = text_of(*in[0]);
      const std::int64_t from = in[1]->integer(), n = in[2]->integer();
      const auto size = static_cast<std::int64_t>(s.size());
      if (from < 1 || n < 0 || from - 1 + n > size)
        return failed(name() + " is of " + std::to_string(n) + " characters from " +
                          std::to_string(from) + " on, and the string has " + std::to_string(size),
                      "1 is the first.");
      cost_ += s.size() / 64;
      std::string made;
      if (c.fn == Fn::extract) {
        made = s.substr(static_cast<std::size_t>(from - 1), static_cast<std::size_t>(n));
      } else {
        made = s;
        made.erase(static_cast<std::size_t>(from - 1), static_cast<std::size_t>(n));
      }
      if (!has_room(made.size() + 64)) return Did::failed;
      const Slot t = new_text(std::move(made));
      if (c.fn == Fn::extract) {
        *out() = t;
      } else if (Slot* to = slots(p, c.arguments[0])) {
        *to = t;
      }
      return Did::done;
    }
    case Fn::list_add:
    case Fn::list_insert:
    case Fn::list_delete:
    case Fn::list_clear:
    case Fn::list_index: {
      const TypeInfo& t = c_.types[c.arguments[0].type];
      const std::size_t each = t.element_slots;
      const Heap::List* known = list_of(*in[0]);
      const std::int64_t n =
          known && each ? static_cast<std::int64_t>(known->slots.size() / each) : 0;
      if (c.fn == Fn::list_index) {
        std::int64_t found = 0;
        for (std::int64_t k = 0; k < n && !found; ++k)
          if (equal(t.element, known->slots.data() + static_cast<std::size_t>(k) * each, in[1]))
            found = k + 1;
        cost_ += static_cast<std::uint64_t>(found ? found : n) * each / 4;
        return whole(found);
      }
      if (c.fn == Fn::list_clear) {
        if (Heap::List* l = list_of(*in[0])) {
          s_.heap.bytes -= std::min<std::uint64_t>(s_.heap.bytes, l->slots.size() * 8);
          l->slots = {};
        }
        return Did::done;
      }
      const std::int64_t place = c.fn == Fn::list_add ? n + 1 : in[1]->integer();
      const std::int64_t last = c.fn == Fn::list_insert ? n + 1 : n;
      if (c.fn != Fn::list_add && (place < 1 || place > last))
        return failed(
            "the place " + std::to_string(place) + " is outside 1.." + std::to_string(last),
            n == 0 ? "The list is empty." : "");
      const auto where = static_cast<std::ptrdiff_t>(place - 1) * static_cast<std::ptrdiff_t>(each);
      if (c.fn == Fn::list_delete) {
        Heap::List* l = list_of(*in[0]);
        l->slots.erase(l->slots.begin() + where,
                       l->slots.begin() + where + static_cast<std::ptrdiff_t>(each));
        s_.heap.bytes -= std::min<std::uint64_t>(s_.heap.bytes, each * 8);
        cost_ += (l->slots.size() - static_cast<std::size_t>(where)) / 16;
        return Did::done;
      }
      if (!has_room(each * 8 + 64)) return Did::failed;
      Slot* list_slot = slots(p, c.arguments[0]);
      if (!list_of(*list_slot)) {
        const Slot made = new_list();
        *slots(p, c.arguments[0]) = made;
        list_slot = slots(p, c.arguments[0]);
      }
      const Slot handle = *list_slot;
      Heap::List* l = list_of(handle);
      const std::vector<Slot> element(in[c.fn == Fn::list_add ? 1 : 2],
                                      in[c.fn == Fn::list_add ? 1 : 2] + each);
      cost_ += (l->slots.size() - static_cast<std::size_t>(where)) / 16;
      l->slots.insert(l->slots.begin() + where, element.begin(), element.end());
      s_.heap.bytes += each * 8;
      if (c_.types[t.element].has_list &&
          !deepen(p, t.element,
                  kListAddress |
                      (static_cast<std::uint64_t>(static_cast<std::uint32_t>(handle.bits)) << 32) |
                      static_cast<std::uint64_t>(where)))
        return Did::failed;
      return Did::done;
    }
    case Fn::open: {
      if (asks()) return Did::waits;
      if (Heap::File* f = file_of(p, c.arguments[0]))
        return failed("the file " + f->name + " is already open", "CLOSE it first.");
      Heap::File made;
      made.name = std::string(text_of(*in[1]));
      made.span = c_.instruction(at_).span;
      const std::string mode(text_of(*in[2]));
      if (mode.size() != 1 || std::string_view("RWArwa").find(mode) == std::string_view::npos)
        return failed("OPEN has no mode '" + mode.substr(0, 40) + "'",
                      "'R' reads, 'W' writes, 'A' adds.");
      made.mode = static_cast<char>(mode[0] & ~0x20);
      if (made.mode == 'R') {
        auto text = world_->read_file(made.name);
        if (!text.ok()) return fail(text.error()), Did::failed;
        made.text = std::move(text).value();
        if (!has_room(made.text.size() + made.name.size())) return Did::failed;
      }
      s_.heap.bytes += made.text.size() + made.name.size();
      ++s_.progress;
      std::size_t i = 0;
      while (i < s_.heap.files.size() && s_.heap.files[i].mode) ++i;
      if (i == s_.heap.files.size()) {
        if (i >= kMostFiles)
          return failed("1000 files are open", "CLOSE what is no longer needed.");
        s_.heap.files.emplace_back();
      }
      s_.heap.files[i] = std::move(made);
      *slots(p, c.arguments[0]) = {kFileTag | i};
      return Did::done;
    }
    case Fn::close: {
      if (asks()) return Did::waits;
      Heap::File* f = file_of(p, c.arguments[0]);
      if (!f) return failed("the file is not open", "OPEN it first.");
      const Heap::File closed = std::exchange(*f, {});
      *slots(p, c.arguments[0]) = {};
      s_.heap.bytes -= std::min<std::uint64_t>(s_.heap.bytes, closed.text.size());
      ++s_.progress;
      if (closed.mode != 'R') {
        const auto done = world_->write_file(closed.name, closed.text, closed.mode == 'A');
        if (!done.ok()) return fail(done.error()), Did::failed;
      }
      return Did::done;
    }
    case Fn::eof:
    case Fn::eol: {
      const Heap::File* f = file_of(p, c.arguments[0]);
      if (!f || f->mode != 'R')
        return failed("the file is not open for reading", "OPEN it with 'R'.");
      const bool is_end = f->at >= f->text.size();
      *out() = Slot::of(is_end || (c.fn == Fn::eol && (f->text[f->at] == '\n' ||
                                                       f->text.compare(f->at, 2, "\r\n") == 0)));
      return Did::done;
    }
    case Fn::write:
    case Fn::writeln:
      if (asks()) return Did::waits;
      if (observer_) observer_->running(p.routine, c_.instruction(at_).span);
      return write(p, c);
    case Fn::read:
    case Fn::readln:
      if (asks()) return Did::waits;
      return read(p, c);
    case Fn::acquire:
    case Fn::release: {
      if (asks()) return Did::waits;
      Slot* s = c.arguments[0].is_reference ? at(p, address_of(p, c.arguments[0]), 1, true)
                                            : slots(p, c.arguments[0]);
      if (!s) return failed("a place of the code does not exist", "Compile the program again.");
      const std::uint64_t address = address_of(p, c.arguments[0]);
      // Places on a stack are of one process.
      const std::uint64_t key = address >= s_.globals.size() && address < kConstantAddress
                                    ? address + ((std::uint64_t{p.routine} + 1) << 40)
                                    : address;
      ++s_.progress;
      if (c.fn == Fn::acquire) {
        if (s->integer() > 0) {
          *s = Slot::of(s->integer() - 1);
          return Did::done;
        }
        p.wait = {};
        p.wait.kind = Waits::semaphore;
        p.wait.address = key;
        p.wait.ticket = s_.next_ticket++;
        return Did::waits;
      }
      // Handed over to who waits: the highest priority, then who came first.
      WaitState* best = nullptr;
      Process* of = nullptr;
      std::uint32_t* pc = nullptr;
      for (Process& other : s_.processes) {
        if (other.is_ended) continue;
        const auto one = [&](WaitState& x, std::uint32_t& at_op) {
          if (x.kind != Waits::semaphore || x.is_granted || x.address != key) return;
          if (best && (other.priority < of->priority ||
                       (other.priority == of->priority && x.ticket > best->ticket)))
            return;
          best = &x;
          of = &other;
          pc = &at_op;
        };
        one(other.wait, other.pc);
        for (Frame& f : other.frames)
          for (WaitState& x : f.put_aside) one(x, f.back);
      }
      if (best) {
        best->is_granted = true;
        wake(*of);
        ++*pc;
        return Did::done;
      }
      if (s->integer() == std::numeric_limits<std::int32_t>::max())
        return failed("the count of the semaphore exceeds the range of INT");
      *s = Slot::of(s->integer() + 1);
      return Did::done;
    }
    case Fn::get_status: {
      const std::int32_t r_ = in[0]->integer();
      const Process* x = r_ >= 0 ? process_of(static_cast<std::uint32_t>(r_)) : nullptr;
      if (!x || x->is_ended) return whole(0);
      if (x->is_stopped) return whole(2);
      const bool is_blocked =
          x->wait.kind != Waits::nothing && x->wait.kind != Waits::motion && !x->wait.is_granted;
      return whole(is_blocked ? 3 : 1);
    }
  }
  return failed("this function of the language is unknown");
}

/// R_ACT_ROB: chooses a robot, or gives the one that was chosen as it is now.
Run::Did Run::act_robot(Process& p, const IntrinsicCall& c) {
  if (!c.has_result) {
    if (p.condition_depth)
      return fail("a condition of UNTIL or WHEN chooses a robot",
                  "Functions called there may only compute."),
             Did::failed;
    p.robot = c.robot;
    return Did::done;
  }
  if (must_wait(p)) return Did::waits;
  const auto of = std::find_if(c_.robots.begin(), c_.robots.end(), [&](const auto& r) {
    return r.first == p.robot || (p.robot == kNone && c_.robots.size() == 1);
  });
  if (of == c_.robots.end())
    return fail(p.robot == kNone
                    ? "R_ACT_ROB has not been set to a robot yet"
                    : "R_ACT_ROB is a robot of a different type than the cell's first robot",
                p.robot == kNone
                    ? "Choose one first, such as R_ACT_ROB := " +
                          std::string(c_.robots.empty() ? "arm"
                                                        : c_.symbol(c_.robots[0].first).name) +
                          ";"
                    : "Name the robot when reading its fields."),
           Did::failed;
  Op o;
  o.n = of->second;
  if (!refresh(p, o)) return Did::failed;
  const std::uint32_t n = c_.types[c.result.type].slots;
  std::copy_n(s_.globals.data() + c_.place_of[of->first].offset, n, slots(p, c.result));
  cost_ += n / 16 + 100;
  return Did::done;
}

/// BRAKE: the motions that an interrupt of this process came into, or those of a robot.
Run::Did Run::brake(Process& p, const IntrinsicCall& c, std::int32_t mode) {
  const auto failed = [&](std::string message, std::string hint) {
    fail(std::move(message), std::move(hint));
    return Did::failed;
  };
  if (must_wait(p)) return Did::waits;
  if (p.condition_depth)
    return failed("a condition of UNTIL or WHEN brakes",
                  "Functions called there may only compute.");
  if (mode != 0 && mode != 1)
    return failed("BRAKE has no mode " + std::to_string(mode),
                  "0 ends the motion, 1 holds it until the interrupt's routine has ended.");
  Frame* interrupt = nullptr;
  for (Frame& f : p.frames)
    if (f.kind == FrameKind::interrupt) interrupt = &f;
  if (mode == 1 && !interrupt)
    return failed(
        "BRAKE(1) holds a motion until the routine of an interrupt has ended, but this is not one",
        "BRAKE ends a motion; STOP holds a process until CONTINUE.");
  ++s_.progress;
  WaitState wait;
  wait.kind = Waits::brake;
  wait.is_behind = true;
  wait.holds = mode == 1;
  for (Process& other : s_.processes) {
    if (other.is_ended || (c.robot == kNone && &other != &p)) continue;
    for (const OpenMotion& m : other.open) {
      if (c.robot != kNone && m.robot != c.robot) {
        const auto is_same = world_->same_robot(m.robot, c.robot);
        if (!is_same.ok()) return fail(is_same.error()), Did::failed;
        if (!*is_same) continue;
      }
      if (mode == 1 && is_held(m.number)) continue;
      const auto done = mode == 1 ? world_->hold_motion(m.number)
                                  : world_->abort_motion(m.number, AbortReason::until);
      if (!done.ok()) return fail(done.error()), Did::failed;
      if (mode == 1) interrupt->held.push_back(m.number);
      wait.braked.push_back(m.number);
    }
  }
  if (wait.braked.empty()) return Did::done;
  p.wait = std::move(wait);
  p.pc = at_ + 1;
  return Did::waits;
}

}  // namespace robomosp::program
