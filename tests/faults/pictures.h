// That a damaged file shows no wrong pixel. What a renderer is given of it, chunks and tiles, is byte for byte what the
// whole file gives, or is not given; so its picture is that of the whole file without the part that is damaged, and
// does not depend on which bit of that part it was.
#pragma once

#include "campaign.h"
#include "goldens.h"
#include "judge.h"

#include <map>
#include <optional>

namespace pbm::faults {

class Pictures {
  public:
    explicit Pictures(const Golden &golden); // which must outlive it

    // `damaged` differs from the golden file in `region` only.
    void check(ByteView damaged, const Region &region, const std::string &story, Tally &tally);

  private:
    // Nothing of a file that is refused as a whole.
    using Picture = std::optional<PixelArray<std::uint32_t>>;

    Picture picture_of(ByteView file, const std::string &story, Tally &tally) const;
    const Picture &expected(const Region &region, Tally &tally);
    bool same_chunks(const Shown &shown) const;
    bool same_tiles(const Shown &shown) const;

    const Golden &golden_;
    Reader reader_;
    std::vector<const LevelDirectory *> directories_; // [level]
    DetailView view_;
    Shown whole_;
    std::vector<std::vector<Chunk>> chunks_; // [level][chunk], decoded
    Picture whole_picture_;
    std::map<std::uint64_t, Picture> expected_; // by the region's begin
};

} // namespace pbm::faults
