// SPDX-License-Identifier: Apache-2.0
// What apropos finds: words of people against names and sentences of commands.
#include <algorithm>
#include <cctype>
#include <mutex>
#include <set>

#include "ioci/core/command.h"
#include "kernel/letters.h"
#include "kernel/text.h"

namespace robomosp::ioci {
namespace {

/// Words that people use for one thing; several words are a phrase, all of which must be there.
constexpr std::string_view kSynonyms[] = {
    "ik, ikine, inverse kinematics",
    "fk, fkine, forward kinematics, direct kinematics",
    "torque, inverse dynamics, effort, rne",
    "draw, render, picture, image, screenshot, view",
    "film, video, movie, animation, animate, gif, mp4, replay",
    "plot, diagram, chart, graph, curve",
    "collision, collide, clearance, touch, intersect, interference",
    "path, trajectory, jtraj, ctraj",
    "mass, weight, weigh",
    "remove, delete, erase, forget",
    "load, open, read, import",
    "save, write, export, store",
    "velocity, speed, rate",
    "tool, tcp, end effector, flange, gripper, hand",
    "configuration, joint values, joint angles, pose",
    "simulate, simulation, run, play",
    "create, make, new, build, define",
    "duplicate, copy, clone",
    "list, all, show",
    "solid, part, body, shape, csg",
    "orientation, rotation, rotate",
    "frame, transform, pose, placement",
    "singularity, singular",
    "workspace, reach, reachability",
    "dexterity, manipulability, condition",
    "limit, range, bound",
    "optimal, fastest, time optimal, minimum time",
    "plan, planning, avoid, obstacle",
    "undo, revert",
    "mesh, stl, obj, triangle",
    "step, iges, cad",
    "urdf, mjcf, sdf, robot files",
    "friction, coulomb, viscous",
    "provider, solver, plugin, engine",
    "payload, load carried",
    "jacobian, jacob, differential kinematics",
    "identification, regressor",
    "loop, closed chain, parallel",
    "csv, table, data",
    "parameter, variable, expression",
    "help, manual, documentation",
    "quit, exit, leave",
};

/// Runs of letters and digits.
std::vector<std::string> words_of(std::string_view s) {
  std::vector<std::string> out;
  std::string word;
  for (const char c : text::lower(s) + " ") {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 ||
        (static_cast<unsigned char>(c) & 0x80U) != 0) {
      word += c;
    } else if (!word.empty()) {
      out.push_back(std::exchange(word, {}));
    }
  }
  return out;
}

/// Without the endings that say nothing here: torques, rendering.
std::string stem(std::string w) {
  if (w.size() > 6 && w.ends_with("ing")) w.resize(w.size() - 3);
  else if (w.size() > 3 && w.ends_with("s") && !w.ends_with("ss") && !w.ends_with("is"))
    w.pop_back();
  return w;
}

struct Entry {
  const CommandSpec* spec;
  std::vector<std::string> name, summary;
  std::string all;  ///< lower case
};

/// How well a word fits: in the name, the summary, or what else is said.
int fit(const Entry& e, const std::string& word) {
  const auto in = [&word](const std::vector<std::string>& words, int whole, int start) {
    int best = 0;
    for (const std::string& w : words)
      if (w == word) best = std::max(best, whole);
      else if (w.starts_with(word)) best = std::max(best, start);
    return best;
  };
  const int name = in(e.name, 100, word.size() > 2 ? 80 : 0);
  if (name > 0) return name;
  const int summary = in(e.summary, 50, word.size() > 2 ? 40 : 0);
  if (summary > 0) return summary;
  return word.size() > 2 && e.all.find(word) != std::string::npos ? 10 : 0;
}

/// A phrase fits as its worst word does.
int fit(const Entry& e, const std::vector<std::string>& phrase) {
  int worst = 1000;
  for (const std::string& w : phrase) worst = std::min(worst, fit(e, stem(w)));
  return phrase.empty() ? 0 : worst;
}

using Phrase = std::vector<std::string>;

/// The phrases that mean what a word means.
std::vector<Phrase> meanings(const std::string& word) {
  std::vector<Phrase> out;
  for (const std::string_view group : kSynonyms) {
    std::vector<Phrase> phrases;
    bool is_it = false;
    for (const std::string_view p : text::split(group, ',')) {
      phrases.push_back(words_of(p));
      // Also a word that is not typed to its end.
      is_it = is_it || (phrases.back().size() == 1 &&
                        (stem(phrases.back()[0]) == word ||
                         (word.size() > 3 && phrases.back()[0].starts_with(word))));
    }
    if (is_it) out.insert(out.end(), phrases.begin(), phrases.end());
  }
  return out;
}

int best_fit(const Entry& e, const std::string& word, const std::vector<Phrase>& same) {
  int best = fit(e, word);
  for (const Phrase& p : same) best = std::max(best, fit(e, p) * 6 / 10);
  return best;
}

}  // namespace

std::vector<std::string> CommandTable::meant(std::string_view topic, std::string_view verb) const {
  constexpr int kOfName = 1000, kOfMeaning = 100, kLeast = 40;
  constexpr std::size_t kShortest = 2, kMost = 3;
  const std::vector<std::string> wanted = words_of(verb);
  if (verb.size() < kShortest || wanted.empty()) return {};
  const std::vector<Phrase> same =
      wanted.size() == 1 ? meanings(stem(wanted.front())) : std::vector<Phrase>();
  std::vector<std::pair<int, std::string>> found;
  for (const auto& [name, spec] : by_name_) {
    const auto dot = name.find('.');
    if (!topic.empty() && name.substr(0, dot) != topic) continue;
    const Entry e{spec,
                  words_of(dot == std::string::npos ? name : name.substr(dot + 1)),
                  words_of(spec->summary),
                  {}};
    const bool is_of_name = std::all_of(wanted.begin(), wanted.end(), [&e](const std::string& w) {
      return std::find(e.name.begin(), e.name.end(), w) != e.name.end();
    });
    // Without a topic one word of a name says too little.
    int score = is_of_name && (!topic.empty() || e.name.size() == wanted.size()) ? kOfName : 0;
    for (const Phrase& p : same)
      if (const int one = fit(e, p); one >= kLeast) score = std::max(score, kOfMeaning + one);
    if (score > 0) found.emplace_back(score - static_cast<int>(e.name.size()), name);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> out;
  for (const auto& [score, name] : found)
    if (score == found.front().first && out.size() < kMost) out.push_back(name);
  return out;
}

std::vector<const CommandSpec*> CommandTable::apropos(std::string_view words) const {
  const std::shared_lock lock(mutex_);
  std::vector<Entry> entries;
  for (const auto& [name, spec] : by_name_) {
    Entry e{spec, words_of(name), words_of(spec->summary),
            text::lower(name + " " + spec->classic + " " + spec->summary + " " + spec->details)};
    for (const ParamSpec& p : spec->params) e.all += " " + text::lower(p.name);
    entries.push_back(std::move(e));
  }
  std::vector<int> least(entries.size(), 1000), most(entries.size(), 0), sum(entries.size(), 0);
  const std::vector<std::string> wanted = words_of(words);
  for (const std::string& given : wanted) {
    std::string word = stem(given);
    std::vector<int> scores(entries.size(), 0);
    const auto score = [&] {
      const std::vector<Phrase> same = meanings(word);
      bool any = false;
      for (std::size_t i = 0; i < entries.size(); ++i) {
        scores[i] = best_fit(entries[i], word, same);
        any = any || scores[i] > 0;
      }
      return any;
    };
    if (!score()) {
      // As it is nobody has it: the nearest word there is.
      std::set<std::string> known;
      for (const Entry& e : entries) {
        known.insert(e.name.begin(), e.name.end());
        known.insert(e.summary.begin(), e.summary.end());
      }
      for (const std::string_view group : kSynonyms)
        for (std::string& w : words_of(group)) known.insert(std::move(w));
      const std::vector<std::string> all(known.begin(), known.end());
      if (const auto near = text::nearest(given, all)) {
        word = stem(*near);
        (void)score();
      }
    }
    for (std::size_t i = 0; i < entries.size(); ++i) {
      least[i] = std::min(least[i], scores[i]);
      most[i] = std::max(most[i], scores[i]);
      sum[i] += scores[i];
    }
  }
  // All words if anything has them, else any. Where few have all of them, those follow that have
  // one in their name.
  constexpr std::size_t kFew = 3;
  constexpr int kInName = 80;
  const auto has_all = [&](std::size_t i) { return least[i] > 0; };
  std::size_t count = 0;
  for (std::size_t i = 0; !wanted.empty() && i < entries.size(); ++i) count += has_all(i);
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < entries.size(); ++i)
    if (!wanted.empty() &&
        (count == 0 ? sum[i] > 0 : has_all(i) || (count < kFew && most[i] >= kInName)))
      found.push_back(i);
  std::stable_sort(found.begin(), found.end(), [&](std::size_t a, std::size_t b) {
    return has_all(a) != has_all(b) ? has_all(a) : sum[a] > sum[b];
  });
  std::vector<const CommandSpec*> out;
  out.reserve(found.size());
  for (const std::size_t i : found) out.push_back(entries[i].spec);
  return out;
}

}  // namespace robomosp::ioci
