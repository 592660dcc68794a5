// SPDX-License-Identifier: Apache-2.0
// Files of the language, and what it writes to the screen and reads from the keyboard.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "program/intrinsics.h"

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

Run::Did Run::Intrinsic::files() {
  switch (c.fn) {
    case Fn::open: {
      if (run.must_wait(p)) return Did::waits;
      if (Heap::File* f = run.file_of(p, c.arguments[0]))
        return failed("the file " + f->name + " is already open", "CLOSE it first.");
      Heap::File made;
      made.name = std::string(run.text_of(*in[1]));
      made.span = run.c_.instruction(run.at_).span;
      const std::string mode(run.text_of(*in[2]));
      if (mode.size() != 1 || std::string_view("RWArwa").find(mode) == std::string_view::npos)
        return failed("OPEN has no mode '" + mode.substr(0, 40) + "'",
                      "'R' reads, 'W' writes, 'A' adds.");
      made.mode = static_cast<char>(mode[0] & ~0x20);
      if (made.mode == 'R') {
        auto text = run.world_->read_file(made.name);
        if (!text.ok()) return run.fail(text.error()), Did::failed;
        made.text = std::move(text).value();
        if (!run.has_room(made.text.size() + made.name.size())) return Did::failed;
      }
      run.s_.heap.bytes += made.text.size() + made.name.size();
      ++run.s_.progress;
      std::size_t i = 0;
      while (i < run.s_.heap.files.size() && run.s_.heap.files[i].mode) ++i;
      if (i == run.s_.heap.files.size()) {
        if (i >= kMostFiles)
          return failed("1000 files are open", "CLOSE what is no longer needed.");
        run.s_.heap.files.emplace_back();
      }
      run.s_.heap.files[i] = std::move(made);
      *run.slots(p, c.arguments[0]) = {kFileTag | i};
      return Did::done;
    }
    case Fn::close: {
      if (run.must_wait(p)) return Did::waits;
      Heap::File* f = run.file_of(p, c.arguments[0]);
      if (!f) return failed("the file is not open", "OPEN it first.");
      const Heap::File closed = std::exchange(*f, {});
      *run.slots(p, c.arguments[0]) = {};
      run.s_.heap.bytes -= std::min<std::uint64_t>(run.s_.heap.bytes, closed.text.size());
      ++run.s_.progress;
      if (closed.mode != 'R') {
        const auto done = run.world_->write_file(closed.name, closed.text, closed.mode == 'A');
        if (!done.ok()) return run.fail(done.error()), Did::failed;
      }
      return Did::done;
    }
    case Fn::eof:
    case Fn::eol: {
      const Heap::File* f = run.file_of(p, c.arguments[0]);
      if (!f || f->mode != 'R')
        return failed("the file is not open for reading", "OPEN it with 'R'.");
      const bool is_end = f->at >= f->text.size();
      *out() = Slot::of(is_end || (c.fn == Fn::eol && (f->text[f->at] == '\n' ||
                                                       f->text.compare(f->at, 2, "\r\n") == 0)));
      return Did::done;
    }
    case Fn::write:
    case Fn::writeln:
      if (run.must_wait(p)) return Did::waits;
      if (run.observer_) run.observer_->running(p.routine, run.c_.instruction(run.at_).span);
      return run.write(p, c);
    case Fn::read:
    case Fn::readln:
      if (run.must_wait(p)) return Did::waits;
      return run.read(p, c);
    default: return unknown();
  }
}

}  // namespace robomosp::program
