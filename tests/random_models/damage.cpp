#include "random_models/damage.h"

#include "pbm_format/container/content_id.h"
#include "unit/support/file_editor.h"

#include "pbm_format/reading/load_model.h"
#include "unit/support/value_of.h"

#include <algorithm>
#include <array>
#include <vector>

namespace pbm::test {

namespace {

struct DamagedField {
    std::size_t offset, bytes;
};
constexpr std::array<DamagedField, 24> kHeaderFields{
    {{8, 2},  {10, 2}, {12, 4}, {16, 8}, {24, 8}, {32, 4}, {36, 1}, {37, 1},  {40, 8},  {48, 8},  {56, 8},  {64, 8},
     {72, 8}, {88, 2}, {90, 1}, {93, 1}, {94, 1}, {95, 1}, {96, 1}, {100, 1}, {104, 4}, {108, 4}, {112, 8}, {90, 2}}};
constexpr std::array<DamagedField, 11> kTableFields{
    {{0, 4}, {4, 2}, {6, 2}, {8, 4}, {12, 4}, {16, 4}, {20, 4}, {24, 8}, {32, 8}, {40, 8}, {48, 8}}};
constexpr std::array<DamagedField, 14> kChunkFields{{{0, 8},
                                                     {16, 4},
                                                     {20, 4},
                                                     {24, 4},
                                                     {28, 4},
                                                     {32, 4},
                                                     {36, 2},
                                                     {38, 2},
                                                     {40, 1},
                                                     {41, 4},
                                                     {48, 4},
                                                     {51, 1},
                                                     {52, 4},
                                                     {56, 4}}};
constexpr std::array<DamagedField, 9> kRasterFields{
    {{8, 4}, {12, 4}, {16, 4}, {20, 2}, {22, 1}, {23, 1}, {40, 4}, {43, 1}, {44, 4}}};

class Damager {
  public:
    Damager(Bytes file, const Choose &choose) : file_(std::move(file)), choose_(choose) {}

    Damaged run() {
        for (std::uint64_t edits = 1 + choose_(4) * choose_(2); edits > 0 && file_.bytes().size() > kHeaderBytes;
             --edits)
            edit();
        file_.repair();
        if (choose_(2) == 0)
            sign();
        return {std::move(file_.bytes()), std::move(story_)};
    }

  private:
    std::size_t size() { return file_.bytes().size(); }
    void say(const char *what, std::size_t at) { story_ += std::string(what) + " at " + std::to_string(at) + "; "; }

    std::uint64_t get(const DamagedField &field, std::size_t record) const {
        std::uint64_t value = 0;
        for (std::size_t byte = 0; byte < field.bytes; ++byte)
            value |= std::uint64_t{file_.get<std::uint8_t>(record + field.offset + byte)} << 8 * byte;
        return value;
    }
    void set(const DamagedField &field, std::size_t record, std::uint64_t value) {
        for (std::size_t byte = 0; byte < field.bytes; ++byte)
            file_.set(record + field.offset + byte, static_cast<std::uint8_t>(value >> 8 * byte));
    }

    // Another value: an edge, near the old value, one bit changed, near the file size, or twice the old one.
    std::uint64_t another(std::uint64_t old) {
        constexpr std::array<std::uint64_t, 12> kEdges{0,
                                                       1,
                                                       0x7F,
                                                       0x80,
                                                       0xFF,
                                                       0xFFFF,
                                                       0x7FFFFFFF,
                                                       0x80000000,
                                                       0xFFFFFFFF,
                                                       0x10000000,
                                                       ~std::uint64_t{0},
                                                       std::uint64_t{1} << 63};
        switch (choose_(6)) {
        case 0: return kEdges[choose_(kEdges.size())];
        case 1: return old + 1 + choose_(8);
        case 2: return old - 1 - choose_(8);
        case 3: return old ^ std::uint64_t{1} << choose_(64);
        case 4: return size() - choose_(64);
        default: return old * 2 + choose_(256);
        }
    }

    template <std::size_t n> void change_field(const std::array<DamagedField, n> &fields, std::size_t record) {
        const DamagedField &field = fields[choose_(n)];
        say("field", record + field.offset);
        set(field, record, another(get(field, record)));
    }

    std::size_t sections() const { return std::min<std::size_t>(file_.get<std::uint32_t>(32), kMaxSections); }
    // Offset of the table entry of a random section.
    std::size_t any_entry() {
        return kHeaderBytes + kSectionEntryBytes * choose_(std::max<std::size_t>(1, sections()));
    }
    // The same for a section that satisfies `wanted`, if 16 tries find one.
    template <class Wanted> std::size_t entry_of(Wanted &&wanted) {
        std::size_t at = any_entry();
        for (int tries = 0; tries < 16 && !wanted(SectionType{file_.get<std::uint32_t>(at)}); ++tries)
            at = any_entry();
        return at;
    }
    std::size_t start_of(std::size_t entry) const { return file_.get<std::uint64_t>(entry + 24); }
    // A random offset in the section of that entry, within the file.
    std::size_t inside(std::size_t entry) {
        const std::uint64_t bytes = std::max<std::uint64_t>(1, file_.get<std::uint64_t>(entry + 32));
        return (start_of(entry) + choose_(bytes)) % size();
    }

    void change_chunk_entry() {
        const std::size_t entry = entry_of([](SectionType type) { return type == SectionType::level_directory; });
        const std::uint64_t chunks = std::clamp<std::uint64_t>(file_.get<std::uint64_t>(entry + 48), 1, 4096);
        change_field(kChunkFields, start_of(entry) + file_.get<std::uint32_t>(entry + 12) * choose_(chunks));
    }

    void exchange(std::size_t a, std::size_t b, std::size_t bytes) {
        say("exchanged", a);
        for (std::size_t i = 0; i < bytes; ++i) {
            const auto first = file_.get<std::uint8_t>(a + i);
            file_.set(a + i, file_.get<std::uint8_t>(b + i));
            file_.set(b + i, first);
        }
    }

    void copy_range() {
        const std::size_t from = inside(any_entry()), to = inside(any_entry());
        const std::size_t bytes = std::min<std::size_t>(1 + choose_(64), size() - std::max(from, to));
        say("copied", to);
        for (std::size_t i = 0; i < bytes; ++i)
            file_.set(to + i, file_.get<std::uint8_t>(from + i));
    }

    void flip_bits() {
        const std::size_t at = choose_(2) == 0 ? choose_(size()) : inside(any_entry());
        say("flipped", at);
        for (std::uint64_t flips = 1 + choose_(3); flips > 0; --flips)
            file_.flip(8 * std::min<std::uint64_t>(at + choose_(4), size() - 1) + choose_(8));
    }

    // Removes a record, so that a directory or table is too short.
    void shorten_section() {
        const std::size_t entry = any_entry();
        const std::uint64_t bytes = 8 * (1 + choose_(8));
        if (file_.get<std::uint64_t>(entry + 32) <= bytes || start_of(entry) > size() ||
            file_.get<std::uint64_t>(entry + 32) > size() - start_of(entry) || entry + kSectionEntryBytes > size())
            return;
        say("shortened", entry);
        file_.shorten(SectionType{file_.get<std::uint32_t>(entry)}, file_.get<std::uint32_t>(entry + 8), bytes, 8);
    }

    void resize() {
        const bool shorter = choose_(2) == 0;
        say(shorter ? "cut" : "continued", size());
        file_.bytes().resize(shorter ? size() - 1 - choose_(std::min<std::size_t>(size() - 1, 512))
                                     : size() + 1 + choose_(64),
                             static_cast<std::uint8_t>(choose_(2)));
        if (choose_(2) == 0)
            file_.set<std::uint64_t>(16, size());
    }

    void edit() {
        switch (choose_(12)) {
        case 0: return change_field(kHeaderFields, 0);
        case 1:
        case 2: return change_field(kTableFields, any_entry());
        case 3:
        case 4: return change_chunk_entry();
        case 5: {
            const std::size_t entry = entry_of(is_raster);
            return change_field(kRasterFields, start_of(entry) + 16 * choose_(4));
        }
        case 6: { // a random field of a small section
            const std::size_t entry = entry_of([](SectionType type) { return type <= SectionType::ground_plane; });
            const std::size_t at = start_of(entry) + 4 * choose_(64);
            return change_field(std::array<DamagedField, 2>{{{0, 4}, {0, 1}}}, at);
        }
        case 7: return exchange(any_entry(), any_entry(), kSectionEntryBytes);
        case 8: return copy_range();
        case 9: return choose_(2) == 0 ? shorten_section() : resize();
        default: return flip_bits();
        }
    }

    // Repairs the content_id, if the model can be read.
    void sign() {
        constexpr std::uint64_t kMaxMemory = 64 << 20;
        Result<Reader> reader = Reader::open(file_.bytes());
        if (!reader)
            return;
        const Result<Model> model = load_model(*reader, {.threads = 1, .max_memory = kMaxMemory});
        if (!model)
            return;
        std::vector<std::vector<ChunkShape>> shapes(1);
        for (int level = 1; level <= reader->depth(); ++level) {
            shapes.emplace_back();
            for (const ChunkEntry &chunk : value_of(reader->directory(level))->chunks)
                shapes.back().push_back(chunk.shape);
        }
        const ContentId id = content_id(*model, shapes, reader->header().chunk_points);
        file_.set(72, id[0]);
        file_.set(80, id[1]);
        file_.repair();
        story_ += "signed";
    }

    FileEditor file_;
    const Choose &choose_;
    std::string story_;
};

} // namespace

Damaged damage(Bytes file, const Choose &choose) { return Damager(std::move(file), choose).run(); }

} // namespace pbm::test
