// SPDX-License-Identifier: Apache-2.0
#include "recorder.h"

#include <charconv>
#include <cmath>
#include <string_view>
#include <utility>

namespace robomosp::bridges {
namespace {

/// A controller that was started anew, and no row that came late.
constexpr double kJumpBack = 1.0;
constexpr std::chrono::milliseconds kFirstPause{250}, kLongestPause{10000};
constexpr double kTimeout = 10;

void print(std::string& out, double v) {
  if (std::isnan(v)) {
    out += "\"nan\"";
    return;
  }
  if (std::isinf(v)) {
    out += v > 0 ? "\"inf\"" : "\"-inf\"";
    return;
  }
  char text[40];
  out.append(text, std::to_chars(text, text + sizeof text, v).ptr);
}

/// The argument `columns` of recording.create and recording.append.
std::string columns_json(const RecordingWish& wish, const std::vector<const Row*>& rows,
                         double origin) {
  std::string out = "[";
  for (std::size_t c = 0; c <= wish.columns.size(); ++c) {
    if (c > 0) out += ",";
    out +=
        "{\"name\":" + (c == 0 ? std::string("\"time\"") : Json(wish.columns[c - 1].name).dump()) +
        ",\"unit\":" + Json(c == 0 ? std::string("s") : wish.columns[c - 1].unit).dump() +
        ",\"values\":[";
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (r > 0) out += ",";
      print(out, c == 0 ? rows[r]->values[0] - origin : rows[r]->values[c]);
    }
    out += "]}";
  }
  return out + "]";
}

}  // namespace

Recorder::Recorder(ServerWish server, std::vector<RecordingWish> recordings, Log& log,
                   const volatile std::sig_atomic_t* stop)
    : server_(std::move(server)), log_(log), client_(rmpc_new()) {
  for (RecordingWish& wish : recordings) {
    recordings_.emplace_back();
    recordings_.back().wish = std::move(wish);
  }
  if (client_) {
    rmpc_set_timeout(client_, kTimeout);
    rmpc_set_stop(client_, stop);
  }
}
Recorder::~Recorder() { rmpc_free(client_); }

void Recorder::lost() {
  rmpc_close(client_);
  if (was_connected_)
    log_.say(std::string("The connection to ROBOMOSP was lost: ") + rmpc_message(client_) +
             " Rows are kept; reconnecting.");
  was_connected_ = false;
  next_try_ = std::chrono::steady_clock::now() + pause_;
}

rmpc_client* Recorder::connected() {
  if (!client_) return nullptr;
  if (rmpc_is_open(client_)) return client_;
  if (was_connected_) lost();
  const auto now = std::chrono::steady_clock::now();
  if (now < next_try_) return nullptr;
  if (rmpc_connect(client_, server_.address.c_str(),
                   server_.token.empty() ? nullptr : server_.token.c_str()) != RMPC_OK) {
    log_.often("connect", rmpc_message(client_));
    next_try_ = now + pause_;
    pause_ = std::min(2 * pause_, kLongestPause);
    return nullptr;
  }
  pause_ = kFirstPause;
  const char* instance = "";
  (void)rmpc_get_text(client_, "instance", &instance);
  if (instance_ != instance) {
    if (!instance_.empty())
      log_.say("Another ROBOMOSP answers at " + server_.address + "; starting new recordings.");
    for (Growing& g : recordings_) g.is_open = false, g.in_doubt = 0, g.before.clear();
    instance_ = instance;
  }
  log_.say("Connected to ROBOMOSP at " + server_.address + ".");
  was_connected_ = true;
  ++connections_;
  for (Growing& g : recordings_)
    if (!settle(g)) return nullptr;
  return client_;
}

bool Recorder::settle(Growing& g) {
  if (g.in_doubt == 0) return true;
  if (!g.is_open) {  // it was begun, and its handle did not come back: nobody else will remove it
    g.in_doubt = 0;
    return true;
  }
  if (rmpc_call(client_, "recording.list", nullptr) != RMPC_OK) {
    if (rmpc_is_open(client_)) return true;
    lost();
    return false;
  }
  for (std::size_t i = 0; i < rmpc_count(client_, ""); ++i) {
    const std::string at = "[" + std::to_string(i) + "]";
    rmpc_handle h{};
    long long samples = 0;
    if (rmpc_get_handle(client_, (at + ".recording").c_str(), &h) != RMPC_OK ||
        h.number != g.handle.number ||
        rmpc_get_integer(client_, (at + ".samples").c_str(), &samples) != RMPC_OK)
      continue;
    if (static_cast<std::size_t>(samples) > g.rows) {
      counts_.recorded += static_cast<std::size_t>(samples) - g.rows;
      g.rows = static_cast<std::size_t>(samples);
      g.last = g.last_in_doubt;
    }
  }
  g.in_doubt = 0;
  return true;
}

Recorder::Outcome Recorder::send(Growing& g, const std::vector<const Row*>& rows) {
  const double end = rows.back()->values[0];
  if (!g.is_open) {
    g.origin = rows.front()->values[0];
    rmpc_begin(client_, "recording.create");
    rmpc_put_text(client_, "title", g.wish.title.c_str());
    if (!g.wish.robot.empty()) rmpc_put_text(client_, "robot", g.wish.robot.c_str());
    if (!g.wish.world.empty()) rmpc_put_text(client_, "world", g.wish.world.c_str());
  } else {
    rmpc_begin(client_, "recording.append");
    rmpc_put_handle(client_, "id", &g.handle);
  }
  rmpc_put_json(client_, "columns", columns_json(g.wish, rows, g.origin).c_str());
  g.in_doubt = rows.size();
  g.last_in_doubt = end;
  const rmpc_status status = rmpc_send(client_);
  if (status == RMPC_OK && !g.is_open) {
    if (rmpc_get_handle(client_, "", &g.handle) != RMPC_OK) return Outcome::refused;
    g.is_open = true;
    g.rows = 0;
    log_.say("Recording \"" + g.wish.title + "\" is recording#" + std::to_string(g.handle.number) +
             ".");
  }
  if (status == RMPC_OK) {
    g.in_doubt = 0;
    g.rows += rows.size();
    g.last = end;
    counts_.recorded += rows.size();
    return Outcome::done;
  }
  if (status != RMPC_REFUSED) {  // also where no answer came: whether the rows did is asked later
    lost();
    return Outcome::lost;
  }
  g.in_doubt = 0;
  return Outcome::refused;
}

void Recorder::append(std::vector<Row>& rows) {
  if (!connected()) return;
  for (std::size_t k = 0; k < recordings_.size(); ++k) {
    Growing& g = recordings_[k];
    std::size_t at = 0;
    while (at < rows.size()) {
      // As many as go into one recording, in the order of their time.
      std::vector<const Row*> batch;
      bool is_full = g.is_open && g.rows >= g.wish.most_rows;
      double last = g.last;
      bool is_new = !g.is_open || is_full;
      std::size_t end = at;
      for (; end < rows.size(); ++end) {
        Row& row = rows[end];
        if (row.recording != k || row.values.empty()) continue;
        const bool has_before = !batch.empty() || (g.is_open && !is_full);
        if (has_before && row.values[0] < last - kJumpBack) {
          if (!batch.empty()) break;
          log_.say("The time of \"" + g.wish.title + "\" jumped back; starting a new recording.");
          is_new = is_full = true;
        } else if ((has_before || is_full) && row.values[0] <= last) {
          ++counts_.late;
          log_.often("late " + g.wish.title,
                     "A row of \"" + g.wish.title + "\" is not later than the one before it.");
          row.values.clear();
          continue;
        }
        if ((is_new ? 0 : g.rows) + batch.size() >= g.wish.most_rows) break;
        last = row.values[0];
        batch.push_back(&row);
      }
      if (is_new && g.is_open) {
        g.before.push_back(g.handle);
        g.is_open = false;
      }
      if (batch.empty()) {
        at = end;
        continue;
      }
      const Outcome outcome = send(g, batch);
      if (outcome == Outcome::lost) {
        std::erase_if(rows, [](const Row& r) { return r.values.empty(); });
        return;
      }
      if (outcome == Outcome::refused) {
        const bool is_gone = g.is_open && (std::string_view(rmpc_code(client_)) == "stale_handle" ||
                                           std::string_view(rmpc_code(client_)) == "not_found");
        log_.often("refused " + g.wish.title, std::string(rmpc_message(client_)) +
                                                  (is_gone ? " Starting a new recording." : ""));
        if (is_gone) {
          g.is_open = false;
          continue;  // the same rows once more, into a recording of their own
        }
        counts_.refused += batch.size();
      }
      for (const Row* row : batch) rows[static_cast<std::size_t>(row - rows.data())].values.clear();
      at = end;
      while (g.is_open && g.before.size() >= g.wish.keep) {
        rmpc_begin(client_, "recording.remove");
        rmpc_put_handle(client_, "id", &g.before.front());
        if (rmpc_send(client_) != RMPC_OK && !rmpc_is_open(client_)) break;
        g.before.erase(g.before.begin());
      }
    }
  }
  rows.clear();
}

}  // namespace robomosp::bridges
