#include "pbm_batch/build_batch.h"

#include "pbm_batch/memory_estimate.h"
#include "system/processes/child_program.h"
#include "system/threads/parallel.h"
#include "system/threads/thread_pool.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <stop_token>
#include <system_error>

namespace pbm::batch {
namespace {

constexpr int kKilled = 4; // exit code of a build that a signal ended: most likely for want of memory

std::uint64_t peak_of(const std::string &document) {
    const auto json = nlohmann::json::parse(document, nullptr, false);
    const auto found = json.is_object() ? json.find("peak_memory") : json.end();
    return json.is_object() && found != json.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
}

// Requests a stop unless it is destroyed before `seconds` have passed; 0: never.
class Timeout {
  public:
    explicit Timeout(double seconds) : clock_(seconds > 0 ? 2 : 1) { // one thread waits
        if (seconds > 0)
            clock_.post([this, seconds] {
                std::unique_lock lock(mutex_);
                if (!over_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return is_over_; }))
                    stop_.request_stop();
            });
    }
    ~Timeout() {
        const std::lock_guard lock(mutex_);
        is_over_ = true;
        over_.notify_one();
    }
    Timeout(const Timeout &) = delete;
    Timeout &operator=(const Timeout &) = delete;

    std::stop_token token() const { return stop_.get_token(); }
    bool has_passed() const { return stop_.stop_requested(); }

  private:
    std::mutex mutex_; // guards is_over_
    std::condition_variable over_;
    bool is_over_ = false;
    std::stop_source stop_;
    ThreadPool clock_; // the last member, since it waits for its thread
};

class Batch {
  public:
    Batch(std::span<const Scan> scans, const Request &request, const std::function<void(const Ending &)> &ended)
        : scans_(scans), request_(request), ended_(ended) {}

    void run() {
        const int jobs =
            std::clamp<int>(request_.jobs, 1, static_cast<int>(std::min<std::size_t>(scans_.size(), kMaxThreads)));
        threads_of_build_ = std::max(1, request_.threads / jobs);
        parallel_for(static_cast<std::size_t>(jobs), jobs, [this](std::size_t) { work(); });
    }

  private:
    void work() {
        std::unique_lock lock(mutex_);
        while (true) {
            std::uint64_t need = 0;
            const auto fits = [&] {
                if (next_ == scans_.size() || is_stopped_)
                    return true;
                need = estimate_.of(scans_[next_].input, scans_[next_].bytes);
                return running_ == 0 || (used_ < request_.max_memory && need <= request_.max_memory - used_);
            };
            room_.wait(lock, fits);
            if (next_ == scans_.size() || is_stopped_)
                return;
            const Scan &scan = scans_[next_++];
            ++running_;
            used_ += need;
            lock.unlock();
            const Ending ending = build(scan);
            lock.lock();
            --running_;
            used_ -= need;
            if (const std::uint64_t peak = peak_of(ending.document); peak != 0)
                estimate_.learn(scan.input, scan.bytes, peak);
            is_stopped_ = is_stopped_ || (ending.exit_code != 0 && !request_.keep_going);
            ended_(ending);
            room_.notify_all();
        }
    }

    Ending build(const Scan &scan) const {
        Ending ending{.scan = &scan, .message = {}, .warning = {}, .document = {}};
        const auto start = std::chrono::steady_clock::now();
        std::error_code ignored; // the build itself fails, and says why
        std::filesystem::create_directories(std::filesystem::path(scan.output).parent_path(), ignored);
        std::vector<std::string> command = request_.builder;
        command.insert(command.end(),
                       {"--quiet", "--progress", "--json=-", "--threads=" + std::to_string(threads_of_build_),
                        "--output=" + scan.output, "--", scan.input});
        // Lines of progress begin with a number. They end the build if this program is gone.
        const auto keep_document = [&](std::string_view line) {
            if (!line.empty() && !(line.front() >= '0' && line.front() <= '9'))
                ending.document.append(line).append(1, '\n');
        };
        const Timeout timeout(request_.timeout);
        const auto end = run_program(command, keep_document, timeout.token());
        ending.exit_code = !end ? exit_code(end.error().code) : end->exit_code < 0 ? kKilled : end->exit_code;
        if (ending.exit_code != 0)
            ending.message = !end                   ? end.error().message
                             : timeout.has_passed() ? "ended, since it took longer than --timeout allows"
                             : end->exit_code < 0   ? "a signal ended it: perhaps it had too little memory"
                             : end->message.empty() ? "exit code " + std::to_string(end->exit_code)
                                                    : end->message;
        else
            ending.warning = end->message;
        ending.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return ending;
    }

    std::span<const Scan> scans_;
    const Request &request_;
    const std::function<void(const Ending &)> &ended_;
    int threads_of_build_ = 1;

    std::mutex mutex_; // of all below, and of calls of ended_
    std::condition_variable room_;
    MemoryEstimate estimate_;
    std::size_t next_ = 0;
    int running_ = 0;
    std::uint64_t used_ = 0; // by estimates
    bool is_stopped_ = false;
};

} // namespace

void build_all(std::span<const Scan> scans, const Request &request, const std::function<void(const Ending &)> &ended) {
    if (!scans.empty())
        Batch(scans, request, ended).run();
}

} // namespace pbm::batch
