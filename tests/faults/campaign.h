// A campaign repeats one kind of damage and verifies laws after each case.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace pbm::faults {

struct Options {
    bool complete = false; // all cases, which takes minutes; else a sample, which takes seconds
    std::uint64_t seed = 1;
    std::string golden; // flips: only this file; empty: all files
};

// Result of a campaign.
class Tally {
  public:
    void add_case() { ++cases_; }
    void add_detected() { ++detected_; }
    // Records `what` as a violation if `law` is false. Returns `law`.
    bool require(bool law, const std::string &what);
    // Figures for the notes of the row: a sum, a maximum.
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

// cut_files: truncation at every byte. flip_bits: every single bit flipped.
void cut_files(const Options &options, Tally &tally);
void flip_bits(const Options &options, Tally &tally);
// Flips bits and repairs every hash.
void flip_bits_behind_hashes(const Options &options, Tally &tally);
// Sets fields of header, table and directories to edge values, singly and in pairs, and repairs every hash.
void set_fields_to_edges(const Options &options, Tally &tally);
// Decompression bombs: small files that announce or contain huge data.
void send_bombs(const Options &options, Tally &tally);
// The n-th allocation fails, for all n.
void fail_allocations(const Options &options, Tally &tally);
// The file changes while it is mapped.
void change_mapped_files(const Options &options, Tally &tally);
// Opens, verifies and closes valid and invalid files many times.
void open_many_files(const Options &options, Tally &tally);

} // namespace pbm::faults
