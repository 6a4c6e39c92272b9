// What a campaign is: one kind of damage, done again and again, and laws that must hold each time.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace pbm::faults {

struct Options {
    bool complete = false; // all of it, for minutes; else a sample of seconds
    std::uint64_t seed = 1;
    std::string golden; // flips: of this file alone; empty: of all
};

// What came of a campaign.
class Tally {
  public:
    void add_case() { ++cases_; }
    void add_detected() { ++detected_; }
    // Holds a law, or keeps `what` broke it. Returns `law`.
    bool require(bool law, const std::string &what);
    // Figures for the notes: a sum, a largest value.
    void count(const std::string &what, std::uint64_t more = 1) { sums_[what] += more; }
    void note_largest(const std::string &what, double value);

    std::uint64_t cases() const { return cases_; }
    std::uint64_t broken() const { return broken_; }
    // One row of a Markdown table: campaign, cases, detected, laws broken, notes.
    std::string row(const std::string &name, double seconds) const;

  private:
    std::uint64_t cases_ = 0, detected_ = 0, broken_ = 0;
    std::map<std::string, std::uint64_t> sums_;
    std::map<std::string, double> largest_;
};

// Truncation at every byte; every single bit flipped.
void cut_files(const Options &options, Tally &tally);
void flip_bits(const Options &options, Tally &tally);
// Bits flipped, and every hash made right again.
void flip_bits_behind_hashes(const Options &options, Tally &tally);
// Fields of header, table and directories at edge values, singly and in pairs, hashes made right again.
void set_fields_to_edges(const Options &options, Tally &tally);
// Little that says it is much.
void send_bombs(const Options &options, Tally &tally);
// The n-th allocation fails, for all n.
void fail_allocations(const Options &options, Tally &tally);
// The file changes while it is mapped.
void change_mapped_files(const Options &options, Tally &tally);
// Good and bad files opened, judged and closed for ever.
void open_many_files(const Options &options, Tally &tally);

} // namespace pbm::faults
