// A damaged file must not show a wrong pixel. Each chunk and tile that a renderer receives equals that of the intact
// file. So the picture is that of the intact file without the damaged part, whichever bit of the part is damaged.
#pragma once

#include "campaign.h"
#include "goldens.h"
#include "judge.h"

#include <map>
#include <optional>

namespace pbm::faults {

class Pictures {
  public:
    explicit Pictures(const Golden &golden); // `golden` must outlive this object

    // `damaged` differs from the golden file in `region` only.
    void check(ByteView damaged, const Region &region, const std::string &story, Tally &tally);

  private:
    // No value: the file is refused as a whole.
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
    std::vector<std::vector<Sides>> sides_;  // of these chunks
    Picture whole_picture_;
    std::map<std::uint64_t, Picture> expected_; // by begin of the region
};

} // namespace pbm::faults
