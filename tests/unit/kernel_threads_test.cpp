// SPDX-License-Identifier: Apache-2.0
// The application lock, calls that are handed to another thread, and the executor.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <latch>
#include <mutex>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "kernel/app_lock.h"
#include "kernel/call_queue.h"
#include "kernel/executor.h"
#include "kernel/messages.h"

namespace robomosp {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

TEST(AppLock, OneThreadHoldsItAndMayTakeItAgain) {
  AppLock lock;
  int counted = 0;
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&] {
        for (int i = 0; i < 1000; ++i) {
          EXPECT_FALSE(lock.is_held());
          const AppLock::Hold hold(lock, "outer");
          const AppLock::Hold again(lock, "inner");
          EXPECT_TRUE(lock.is_held());
          EXPECT_TRUE(AppLock::is_any_held());
          ++counted;
        }
      });
  }
  EXPECT_EQ(counted, 4000);
  EXPECT_FALSE(AppLock::is_any_held());
  EXPECT_EQ(lock.stats().holds, 4000U) << "what is taken again is one hold";
}

TEST(AppLock, WhatIsPutOffComesAfterTheHoldInOrderAndSurvivesATaskThatThrows) {
  AppLock lock;
  std::vector<int> ran;
  {
    const AppLock::Hold hold(lock, "test");
    lock.later([&] {
      EXPECT_FALSE(lock.is_held());
      ran.push_back(1);
      lock.later([&] { ran.push_back(4); });
      lock.flush();
    });
    lock.later([] { throw std::runtime_error("task"); });
    {
      const AppLock::Hold inner(lock, "inner");
      lock.later([&] { ran.push_back(2); });
    }
    lock.later([&] { ran.push_back(3); });
    lock.flush();
    EXPECT_TRUE(ran.empty()) << "not while it is held";
  }
  EXPECT_EQ(ran, (std::vector<int>{1, 2, 3, 4}));
  lock.later([&] { ran.push_back(5); });
  EXPECT_EQ(ran.size(), 4U);
  lock.flush();
  EXPECT_EQ(ran.size(), 5U);
}

TEST(AppLock, WhoPutsOffMoreThanGetsDoneTakesATurnSoThatNobodyIsKeptAndNothingPilesUp) {
  AppLock lock;
  std::atomic<int> put{0}, called{0}, most{0};
  std::atomic<bool> is_over{false};
  std::set<std::thread::id> callers;  // one task at a time
  const auto busy = [&] {
    while (!is_over) {
      const AppLock::Hold hold(lock, "busy");
      most = std::max(most.load(), ++put - called);
      lock.later([&] {
        callers.insert(std::this_thread::get_id());
        std::this_thread::sleep_for(100us);
        ++called;
      });
    }
  };
  {
    const std::jthread one(busy), two(busy);
    while (called < 1000) std::this_thread::sleep_for(1ms);
    is_over = true;
  }
  EXPECT_EQ(called, put) << "none is left behind";
  EXPECT_EQ(callers.size(), 2U) << "each has its turns";
  EXPECT_LT(most, 600);
}

TEST(AppLock, TooLongAHoldIsCountedAndReportedByName) {
  AppLock lock;
  std::chrono::nanoseconds now{0};
  lock.set_clock([&] { return now; });
  std::string reported;
  lock.on_long_hold([&](const std::string& who, std::chrono::nanoseconds took) {
    EXPECT_FALSE(lock.is_held());
    reported += who + " " + std::to_string(took.count() / 1'000'000);
  });
  {
    const AppLock::Hold hold(lock, "short");
    now += AppLock::kLongestHold;
  }
  EXPECT_EQ(lock.stats().long_holds, 0U);
  {
    const AppLock::Hold hold(lock, "long");
    now += AppLock::kLongestHold + 1ms;
  }
  EXPECT_EQ(lock.stats().long_holds, 1U);
  EXPECT_EQ(lock.stats().longest_by, "long");
  EXPECT_EQ(reported, "long 51");
}

TEST(AppLock, WhoCallsAProviderWhileItIsHeldIsCounted) {
  AppLock lock;
  AppLock::expect_free();
  {
    const AppLock::Hold hold(lock, "test");
    AppLock::expect_free();
  }
  EXPECT_EQ(lock.stats().calls_within, 1U);
}

TEST(AppLock, MessagesOfTheHolderReachSubscribersWhenItHoldsItNoMore) {
  AppLock lock;
  Messages messages;
  messages.deliver_after(lock);
  std::vector<std::string> heard;
  messages.subscribe([&](const Message& m) {
    EXPECT_FALSE(lock.is_held());
    heard.push_back(m.text);
  });
  {
    const AppLock::Hold hold(lock, "test");
    messages.post(Severity::info, "a", "one");
    messages.post(Severity::info, "a", "two");
    EXPECT_TRUE(heard.empty());
    EXPECT_EQ(messages.recent().size(), 2U) << "it is there at once";
  }
  messages.post(Severity::info, "a", "three");
  EXPECT_EQ(heard, (std::vector<std::string>{"one", "two", "three"}));
}

/// A thread that answers while it waits for `stop`.
class Owner {
 public:
  Owner() : thread_([this] { live(); }) { ready_.wait(); }
  ~Owner() { stop(); }
  void stop() {
    {
      const std::lock_guard lock(mutex_);
      is_over_ = true;
      changed_.notify_all();
    }
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] CallQueue& queue() { return *queue_; }
  [[nodiscard]] std::thread::id id() const { return thread_.get_id(); }

 private:
  void live() {
    queue_ = CallQueue::for_this_thread();
    queue_->open();
    ready_.count_down();
    std::unique_lock lock(mutex_);
    wait_serving(lock, changed_, [this] { return is_over_; });
    lock.unlock();
    queue_->close();
  }
  std::latch ready_{1};
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_over_ = false;
  std::shared_ptr<CallQueue> queue_;
  std::thread thread_;
};

TEST(CallQueue, TheOwnerAnswersManyThreadsWhileItWaits) {
  Owner owner;
  std::atomic<int> answered{0};
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&] {
        for (int i = 0; i < 500; ++i) {
          std::thread::id where;
          const auto outcome = owner.queue().call([&] { where = std::this_thread::get_id(); }, 10s);
          ASSERT_EQ(outcome, CallQueue::Outcome::done);
          ASSERT_EQ(where, owner.id());
          ++answered;
        }
      });
  }
  EXPECT_EQ(answered, 2000);
}

TEST(CallQueue, WhoDoesNotComeToItInTimeIsLate) {
  const auto own = CallQueue::for_this_thread();
  own->open();
  CallQueue::Outcome late{}, given_up{}, closed{};
  std::jthread([&] { late = own->call([] { FAIL(); }, 20ms); }).join();
  std::jthread([&] { given_up = own->call([] { FAIL(); }, 10s, [] { return true; }); }).join();
  EXPECT_EQ(late, CallQueue::Outcome::late);
  EXPECT_EQ(given_up, CallQueue::Outcome::given_up);
  EXPECT_FALSE(own->has_calls());
  std::jthread waiting([&] { closed = own->call([] { FAIL(); }, 10s); });
  while (!own->has_calls()) std::this_thread::yield();
  own->close();
  waiting.join();
  EXPECT_EQ(closed, CallQueue::Outcome::closed);
}

TEST(CallQueue, ThreadsThatCallEachOtherAnswerWhileTheyWait) {
  // Each answers a call by calling the other one, to a depth of ten.
  std::shared_ptr<CallQueue> queues[2];
  std::latch ready(2), done(2);
  std::atomic<int> answered{0};
  const std::function<void(int, int)> call = [&](int to, int depth) {
    const std::function<void()> answer = [&, to, depth] {
      EXPECT_TRUE(CallQueue::is_serving());
      ++answered;
      if (depth > 1) call(1 - to, depth - 1);
    };
    EXPECT_EQ(queues[to]->call(answer, 10s), CallQueue::Outcome::done);
  };
  const auto live = [&](int me) {
    queues[me] = CallQueue::for_this_thread();
    queues[me]->open();
    ready.arrive_and_wait();
    for (int i = 0; i < 50; ++i) call(1 - me, 10);
    EXPECT_FALSE(CallQueue::is_serving());
    done.count_down();
    while (!done.try_wait()) {  // the other one may still call
      queues[me]->serve();
      std::this_thread::yield();
    }
    queues[me]->close();
  };
  { std::jthread one(live, 0), two(live, 1); }
  EXPECT_EQ(answered, 2 * 50 * 10);
}

TEST(CallQueue, CallsAreAnsweredInTheOrderInWhichTheyWereMade) {
  const auto own = CallQueue::for_this_thread();
  own->open();
  std::vector<int> order;
  std::vector<std::jthread> callers;
  for (int i = 0; i < 8; ++i) {
    std::atomic<bool> has_called{false};
    // Each is known to wait before the next one calls.
    const CallQueue::Waker waker(*own, [&] { has_called = true; });
    callers.emplace_back([&, i] {
      EXPECT_EQ(own->call([&order, i] { order.push_back(i); }, 10s), CallQueue::Outcome::done);
    });
    while (!has_called) std::this_thread::yield();
  }
  EXPECT_EQ(own->serve(), 8U);
  callers.clear();
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7}));
  own->close();
}

TEST(CallQueue, APatientCallerWaitsBeyondTheLimitUntilItGivesUp) {
  const auto own = CallQueue::for_this_thread();
  own->open();
  std::atomic<bool> gives_up{false};
  CallQueue::Outcome patient{}, given_up{};
  std::atomic<bool> is_first_done{false}, is_served{false};
  std::jthread caller([&] {
    const std::function<bool()> stops = [&] { return gives_up.load(); };
    {
      const CallQueue::PatientScope scope(stops);
      patient = own->call([] {}, 1ms);
      is_first_done = true;
      while (!is_served) std::this_thread::yield();  // serve() also answers calls made meanwhile
      given_up = own->call([] { FAIL(); }, 10s);
    }
    EXPECT_EQ(own->call([] { FAIL(); }, 1ms), CallQueue::Outcome::late);
  });
  while (!own->has_calls()) std::this_thread::yield();
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(own->serve(), 1U);
  is_served = true;
  while (!is_first_done || !own->has_calls()) std::this_thread::yield();
  gives_up = true;
  caller.join();
  EXPECT_EQ(patient, CallQueue::Outcome::done);
  EXPECT_EQ(given_up, CallQueue::Outcome::given_up);
  own->close();
}

TEST(CallQueue, AWaitWithoutCallsEndsWithItsTime) {
  const auto own = CallQueue::for_this_thread();
  std::mutex mutex;
  std::condition_variable changed;
  std::unique_lock lock(mutex);
  EXPECT_FALSE(wait_serving(lock, changed, 10ms, [] { return false; }));
  EXPECT_TRUE(lock.owns_lock());
  EXPECT_TRUE(wait_serving(lock, changed, 10ms, [] { return true; }));
}

TEST(CallQueue, LivesWhileItsOwnerWaitsThoughTheLastWhoSharedItLetsGo) {
  auto shared = CallQueue::for_this_thread();
  std::latch waits(1), is_gone(1);
  const std::jthread other([own = std::move(shared), &waits, &is_gone]() mutable {
    waits.wait();
    own.reset();
    is_gone.count_down();
  });
  std::mutex mutex;
  std::condition_variable never;
  int looks = 0;
  std::unique_lock lock(mutex);
  EXPECT_TRUE(wait_serving(lock, never, 10s, [&] {
    if (++looks == 2) {  // it waits by now
      waits.count_down();
      is_gone.wait();
    }
    return looks > 1;
  }));
  EXPECT_EQ(CallQueue::of_this_thread(), nullptr);
}

TEST(Executor, EachPartIsDoneOnceWhateverTheNumberOfThreads) {
  Executor executor(4);
  for (const std::size_t threads : {1U, 2U, 4U, 16U})
    for (const std::size_t parts : {0U, 1U, 2U, 7U, 100U}) {
      std::vector<std::atomic<int>> done(parts);
      executor.spread(parts, threads, [&](std::size_t i) { ++done[i]; });
      for (const auto& d : done) EXPECT_EQ(d, 1);
    }
}

TEST(Executor, HelpersAreSharedByAllWhoSpreadAndNestedOnesEnd) {
  Executor executor(3);
  std::atomic<int> now{0}, most{0}, total{0};
  const auto leaf = [&](std::size_t) {
    const int together = ++now;
    for (int seen = most; seen < together && !most.compare_exchange_weak(seen, together);) {
    }
    std::this_thread::sleep_for(200us);
    --now;
    ++total;
  };
  std::vector<std::jthread> callers;
  for (int c = 0; c < 3; ++c)
    callers.emplace_back(
        [&] { executor.spread(4, 4, [&](std::size_t) { executor.spread(8, 8, leaf); }); });
  callers.clear();
  EXPECT_EQ(total, 3 * 4 * 8);
  EXPECT_LE(most, 3 + 2) << "three callers and two helpers";
}

TEST(Executor, TasksRunAndTheirThreadsAreUsedAgain) {
  Executor executor(2);
  std::mutex mutex;
  std::vector<std::thread::id> who;
  for (int i = 0; i < 20; ++i) {
    std::latch done(1);
    executor.run([&] {
      {
        const std::lock_guard lock(mutex);
        who.push_back(std::this_thread::get_id());
      }
      done.count_down();
    });
    done.wait();
    std::this_thread::sleep_for(1ms);  // until it waits for the next
  }
  std::sort(who.begin(), who.end());
  const auto threads = std::unique(who.begin(), who.end()) - who.begin();
  EXPECT_LE(threads, 3);
}

TEST(Executor, HelpersOfAThreadThatAnswersACallKnowThatItDoes) {
  const auto own = CallQueue::for_this_thread();
  own->open();
  Executor executor(4);
  std::atomic<int> serving{0}, patient{0};
  std::jthread caller([&] {
    EXPECT_EQ(own->call(
                  [&] {
                    executor.spread(16, 4, [&](std::size_t) {
                      std::this_thread::sleep_for(1ms);  // so that helpers get some
                      serving += CallQueue::is_serving();
                    });
                  },
                  10s),
              CallQueue::Outcome::done);
    const std::function<bool()> never = [] { return false; };
    const CallQueue::PatientScope scope(never);
    executor.spread(16, 4, [&](std::size_t) {
      std::this_thread::sleep_for(1ms);
      patient += CallQueue::Context::here().gives_up == &never;
    });
  });
  while (serving < 16) {
    own->serve();
    std::this_thread::yield();
  }
  caller.join();
  EXPECT_EQ(serving, 16);
  EXPECT_EQ(patient, 16);
  own->close();
}

TEST(Executor, WhatAPartAsksOfTheCallersThreadIsAnsweredThere) {
  const auto own = CallQueue::for_this_thread();
  own->open();
  Executor executor(4);
  std::atomic<int> answered{0};
  executor.spread(8, 4, [&](std::size_t) {
    if (own->is_owner()) {
      ++answered;
      return;
    }
    const auto outcome = own->call([&] { ++answered; }, 10s);
    EXPECT_EQ(outcome, CallQueue::Outcome::done);
  });
  EXPECT_EQ(answered, 8);
  own->close();
}

}  // namespace
}  // namespace robomosp
