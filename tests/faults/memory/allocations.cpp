// The n-th allocation fails, for all n: the task must end with ErrorCode::memory and leak nothing.
#include "allocation_meter.h"
#include "campaign.h"
#include "goldens.h"
#include "judge.h"

#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/writer.h"
#include "unit/support/value_of.h"

#include <array>
#include <new>
#include <thread>

namespace pbm::faults {
namespace {

enum class Task : std::uint8_t { open, verify, validate, load, draw, encode };
constexpr std::array<const char *, 6> kTasks{"open", "verify", "validate", "load_model", "render", "encode_model"};
enum class End : std::uint8_t { done, memory, other };

End end_of(const Status &status) {
    return status ? End::done : status.error().code == ErrorCode::memory ? End::memory : End::other;
}

End end_of(const ValidationReport &report) {
    if (report.valid())
        return End::done;
    for (const Finding &finding : report.findings)
        if (finding.code != ErrorCode::memory)
            return End::other;
    return End::memory;
}

template <class T> Status status_of(const Result<T> &result) { return result ? Status() : Status(result.error()); }

End do_work(Task what, const Golden &golden, const Model &model, int threads) {
    switch (what) {
    case Task::open: return end_of(status_of(Reader::open(golden.bytes)));
    case Task::verify: return end_of(verify(golden.bytes, {.threads = threads}));
    case Task::validate: return end_of(validate(golden.bytes, {.threads = threads}));
    case Task::load: {
        Result<Reader> reader = Reader::open(golden.bytes);
        return end_of(reader ? status_of(load_model(*reader, {.threads = threads, .fields = true}))
                             : Status(reader.error()));
    }
    case Task::encode: return end_of(status_of(encode_model(model, {.threads = threads})));
    case Task::draw: break;
    }
    try { // only renderers throw std::bad_alloc, for `main` to catch
        return end_of(open_and_draw(golden.bytes, threads));
    } catch (const std::bad_alloc &) {
        return End::memory;
    }
}

void fail_all(Task what, const Golden &golden, const Model &model, int threads, bool all_further, std::uint64_t step,
              Tally &tally) {
    for (int warm_up = 0; warm_up < 2; ++warm_up)
        tally.require(do_work(what, golden, model, threads) == End::done, golden.name + ": not done");
    for (std::uint64_t n = 1;; n += step) {
        End end{};
        const auto kept = [&] {
            const std::uint64_t before = heap_use().live;
            std::jthread([&] { // the end of a thread frees its thread-local caches
                fail_allocation(n, all_further);
                end = do_work(what, golden, model, threads);
                fail_allocation(0);
            })
                .join();
            return static_cast<std::int64_t>(heap_use().live - before);
        };
        const bool keeps = kept() > 0 && kept() > 0; // kept once: a library's initialization; twice: a leak
        if (!allocation_failed())
            break;
        const std::string story = golden.name + ", " + kTasks[static_cast<std::size_t>(what)] + ", " +
                                  std::to_string(threads) + " threads, allocation " + std::to_string(n) +
                                  (all_further ? " and all further" : "");
        tally.add_case();
        if (tally.require(end != End::other, story + ": another error than memory") && end == End::memory)
            tally.add_detected();
        else
            tally.count("done with less memory");
        tally.require(!keeps, story + ": keeps memory");
    }
}

} // namespace

void fail_allocations(const Options &options, Tally &tally) {
    for (const Golden &golden : goldens(options.complete ? 16 << 10 : 4 << 10)) {
        Reader reader = value_of(Reader::open(golden.bytes));
        const Model model = value_of(load_model(reader, {.fields = true}));
        for (std::size_t what = 0; what < kTasks.size(); ++what)
            for (const int threads : {1, 3})
                for (const bool all_further : {false, true})
                    fail_all(static_cast<Task>(what), golden, model, threads, all_further,
                             options.complete ? 1 : 1 + what * 3, tally);
    }
}

} // namespace pbm::faults
