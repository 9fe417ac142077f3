#include "planner/node/thinker.hpp"

#include "common/process/cell_clock.hpp"

#include <exception>
#include <utility>

namespace breakshot::planner {

Thinker::Thinker(std::unique_ptr<strategy::Strategy> strategy, strategy::StrokeFilter* filter, std::function<void(Decided)> done)
    : strategy_{std::move(strategy)}, filter_{filter}, done_{std::move(done)}, thread_{[this](const std::stop_token& stop) {
        run(stop);
      }} {}

void Thinker::ask(task::RunStrategy question) {
  const std::lock_guard lock{mutex_};
  question_ = std::move(question);
  at_hand_.request_stop();
  asked_.notify_one();
}

void Thinker::run(const std::stop_token& stop) {
  while (true) {
    task::RunStrategy question;
    {
      std::unique_lock lock{mutex_};
      if (!asked_.wait(lock, stop, [this] { return question_.has_value(); })) return;
      question = *std::exchange(question_, std::nullopt);
      at_hand_ = std::stop_source{};
      question.context.stop = at_hand_.get_token();
    }
    question.context.filter = filter_;
    const Time began = process::monotonic_now();
    Decided decided;
    decided.ticket = question.ticket;
    try {
      decided.decision = question.earlier.empty() ? strategy_->decide(question.scene, question.context)
                                                  : strategy_->revise(question.scene, question.context, question.earlier);
    } catch (const std::exception& error) {
      // A task that is given up with the reason is better than a process that dies with the order.
      decided.decision = {};
      decided.decision.why = std::string{"the strategy failed: "} + error.what();
    }
    decided.think = process::monotonic_now() - began;
    done_(std::move(decided));
  }
}

}  // namespace breakshot::planner
