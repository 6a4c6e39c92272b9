// Damage that hashes do not detect: changes bits and fields, and repairs every hash.
#include "allocation_meter.h"
#include "campaign.h"
#include "goldens.h"
#include "judge.h"

#include "pbm_format/container/content_id.h"
#include "pbm_format/reading/load_model.h"
#include "unit/support/file_editor.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <array>
#include <optional>

#include <unistd.h>

namespace pbm::faults {
namespace {

using test::FileEditor;
using test::Random;

// Memory limit for refusing or decoding any file of a few kilobytes.
constexpr std::uint64_t kBudget = std::uint64_t{32} << 20;
constexpr unsigned kHang = 30; // seconds until SIGALRM ends a case

// If the content_id is the only fault, returns the file with the right one: a changed parameter then gives another
// valid file.
std::optional<Bytes> with_right_content(const Bytes &file, const Status &status) {
    if (status || status.error().message.rfind("8.1", 0) != 0)
        return std::nullopt;
    Reader reader = value_of(Reader::open(file));
    const Result<Model> model = load_model(reader, {.threads = 1, .fields = true});
    if (!model)
        return std::nullopt;
    LevelMasks masks;
    for (const Level &level : model->levels)
        masks.push_back(level.masks);
    const std::uint32_t limit = reader.header().chunk_points;
    const ContentId id = content_id(*model, split_into_chunks(masks, limit), limit);
    FileEditor editor(file);
    editor.set(72, id[0]);
    editor.set(80, id[1]);
    editor.repair();
    return std::move(editor.bytes());
}

// Laws for any bytes: `verify` and `validate` agree, memory stays within the budget, and a valid file can be drawn.
Status judge(const Bytes &file, const std::string &story, Tally &tally) {
    ::alarm(kHang);
    reset_peak();
    const std::uint64_t before = heap_use().live;
    const ValidationReport report = validate(file, {.threads = 1});
    Status status = verify(file, {.threads = 1});
    const Status drawn = open_and_draw(file);
    const std::uint64_t most = heap_use().peak - before;
    ::alarm(0);
    tally.add_case();
    tally.note_largest("MiB", static_cast<double>(most) / (1 << 20));
    tally.require(most <= kBudget, story + ": took " + std::to_string(most >> 20) + " MiB");
    tally.require(report.valid() == status.ok(), story + ": verify and validate differ: " +
                                                     (!status          ? status.error().message
                                                      : report.valid() ? ""
                                                                       : report.findings.front().message));
    if (!status)
        tally.add_detected();
    else if (tally.require(drawn.ok() || drawn.error().code == ErrorCode::usage,
                           story + ": valid but not drawn: " + (drawn ? "" : drawn.error().message)))
        tally.count("valid and drawn");
    return status;
}

void judge_both(const Bytes &file, const std::string &story, Tally &tally) {
    const Status status = judge(file, story, tally);
    if (const std::optional<Bytes> right = with_right_content(file, status))
        static_cast<void>(judge(*right, story + ", content_id made right", tally));
}

struct DamagedField {
    std::uint64_t at = 0;
    unsigned bytes = 0;
};

void add_fields(std::uint64_t at, std::initializer_list<DamagedField> fields, std::vector<DamagedField> &to) {
    for (const DamagedField &field : fields)
        to.push_back({at + field.at, field.bytes});
}

// Fields of header, table, chunk directories and raster headers.
std::vector<DamagedField> fields_of(const Golden &golden) {
    Reader reader = value_of(Reader::open(golden.bytes));
    std::vector<DamagedField> fields;
    add_fields(0, {{8, 2},  {10, 2}, {12, 4}, {16, 8}, {24, 8},  {32, 4},  {36, 1}, {37, 1},
                   {40, 8}, {48, 8}, {56, 8}, {64, 8}, {72, 8},  {80, 8},  {88, 2}, {90, 1},
                   {93, 1}, {94, 1}, {95, 1}, {96, 1}, {104, 4}, {108, 4}, {112, 8}},
               fields);
    for (std::size_t i = 0; i < reader.sections().size(); ++i) {
        const SectionEntry &section = reader.sections()[i];
        add_fields(kHeaderBytes + i * kSectionEntryBytes,
                   {{0, 4}, {4, 2}, {6, 2}, {8, 4}, {12, 4}, {16, 4}, {20, 4}, {24, 8}, {32, 8}, {40, 8}, {48, 8}},
                   fields);
        if (section.type == SectionType::level_directory)
            for (std::uint64_t entry = 0; entry < section.count; ++entry) {
                const std::uint64_t at = section.offset + entry * section.element_bytes;
                add_fields(at,
                           {{0, 8}, {16, 4}, {20, 4}, {24, 4}, {28, 4}, {32, 4}, {36, 2}, {38, 2}, {40, 1}, {41, 1}},
                           fields);
                for (unsigned stream = kChunkEntryFixedBytes; stream < section.element_bytes; stream += 4)
                    add_fields(at + stream, {{0, 3}, {0, 4}, {3, 1}}, fields);
            }
        if (is_raster(section.type)) {
            add_fields(section.offset, {{8, 4}, {12, 4}, {16, 4}, {20, 2}, {22, 1}, {23, 1}}, fields);
            add_fields(section.offset + 32, {{8, 3}, {8, 4}, {11, 1}, {12, 4}}, fields);
        }
    }
    return fields;
}

constexpr std::size_t kEdges = 12;

std::uint64_t edge_value(const FileEditor &editor, const DamagedField &field, std::size_t edge) {
    const std::uint64_t sign = std::uint64_t{1} << (8 * field.bytes - 1), now = editor.get<std::uint64_t>(field.at);
    const std::uint64_t size = editor.get<std::uint64_t>(16);
    const std::array<std::uint64_t, kEdges> values{0,        1,        ~std::uint64_t{0}, ~std::uint64_t{0} - 1,
                                                   sign,     sign - 1, size - 1,          size,
                                                   size + 1, now - 1,  now + 1,           now ^ sign};
    return values[edge];
}

void set_field(FileEditor &editor, const DamagedField &field, std::uint64_t value) {
    for (unsigned byte = 0; byte < field.bytes; ++byte)
        editor.set(field.at + byte, static_cast<std::uint8_t>(value >> 8 * byte));
}

std::string story_of(const Golden &golden, const DamagedField &field, std::uint64_t value) {
    return golden.name + ", " + std::to_string(field.bytes) + " bytes at " + std::to_string(field.at) + " are " +
           std::to_string(value);
}

void judge_field(const Golden &golden, const DamagedField &field, std::size_t edge, Tally &tally) {
    FileEditor editor(golden.bytes);
    const std::uint64_t value = edge_value(editor, field, edge);
    set_field(editor, field, value);
    editor.repair();
    judge_both(editor.bytes(), story_of(golden, field, value), tally);
}

void judge_pair(const Golden &golden, const DamagedField &a, std::size_t edge_a, const DamagedField &b,
                std::size_t edge_b, Tally &tally) {
    FileEditor editor(golden.bytes);
    const std::uint64_t value_a = edge_value(editor, a, edge_a), value_b = edge_value(editor, b, edge_b);
    set_field(editor, a, value_a);
    set_field(editor, b, value_b);
    editor.repair();
    judge_both(editor.bytes(), story_of(golden, a, value_a) + ", " + story_of(golden, b, value_b), tally);
}

} // namespace

void flip_bits_behind_hashes(const Options &options, Tally &tally) {
    const std::uint64_t rounds = options.complete ? 1'000'000 : 4'000;
    const std::vector<Golden> files = goldens(16 << 10);
    std::vector<std::vector<Region>> regions;
    std::vector<Reader> readers;
    for (const Golden &golden : files) {
        readers.push_back(value_of(Reader::open(golden.bytes)));
        if (readers.back().directory(readers.back().depth()))
            regions.push_back(regions_of(readers.back(), golden.bytes));
    }
    for (std::uint64_t round = 0; round < rounds; ++round) {
        Random random(options.seed << 40 | round);
        // The product of two random numbers prefers small files, which have as many features.
        const std::uint64_t which = random.below(files.size()) * random.below(files.size()) / files.size();
        FileEditor editor(files[which].bytes);
        for (std::uint64_t flips = 1 + random.below(3); flips > 0; --flips) {
            const Region &region = regions[which][random.below(regions[which].size())];
            editor.flip(8 * region.begin + random.below(8 * (region.end - region.begin)));
        }
        editor.repair();
        judge_both(editor.bytes(), files[which].name + ", round " + std::to_string(round), tally);
    }
}

void set_fields_to_edges(const Options &options, Tally &tally) {
    const std::vector<Golden> files = goldens(options.complete ? 16 << 10 : 4 << 10);
    for (const Golden &golden : files) {
        const std::vector<DamagedField> fields = fields_of(golden);
        const std::size_t step = options.complete ? 1 : 1 + fields.size() / 40;
        for (std::size_t i = 0; i < fields.size(); i += step)
            for (std::size_t edge = 0; edge < kEdges; ++edge)
                judge_field(golden, fields[i], edge, tally);
    }
    // All pairs of fields of the smallest file, random pairs of every file.
    const std::vector<DamagedField> smallest = fields_of(files.front());
    for (std::size_t a = 0; options.complete && a < smallest.size(); ++a)
        for (std::size_t b = a + 1; b < smallest.size(); ++b)
            for (std::size_t edges = 0; edges < kEdges * kEdges; ++edges)
                judge_pair(files.front(), smallest[a], edges / kEdges, smallest[b], edges % kEdges, tally);
    Random random(options.seed);
    for (int round = 0; round < (options.complete ? 200'000 : 3'000); ++round) {
        const Golden &golden = files[random.below(files.size())];
        const std::vector<DamagedField> fields = fields_of(golden);
        judge_pair(golden, fields[random.below(fields.size())], random.below(kEdges),
                   fields[random.below(fields.size())], random.below(kEdges), tally);
    }
}

} // namespace pbm::faults
