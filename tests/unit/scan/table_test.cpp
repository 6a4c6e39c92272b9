// PCD files and text files of points.
#include "pbm_scan/table/text_cloud.h"
#include "unit/scan/readings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

std::string refusal(const std::string &text, std::string_view name) { return error(text, name).message; }

std::string pcd(const std::string &fields, const std::string &sizes, const std::string &types, int points,
                const std::string &data, const std::string &viewpoint = "0 0 0 1 0 0 0") {
    const std::string count = std::to_string(points);
    return "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS " + fields + "\nSIZE " + sizes + "\nTYPE " +
           types + "\nWIDTH " + count + "\nHEIGHT 1\nVIEWPOINT " + viewpoint + "\nPOINTS " + count + "\nDATA " + data;
}

TEST(Tables, TextBetweenTheNamesAndTheFirstPointIsReported) {
    const Surface s = surface("x,y,z\nm,m,m\n1,2,3\n4,5,6\n", "scan.csv");
    EXPECT_EQ(s.positions.size(), 2U);
    EXPECT_TRUE(reports(s, "text", Fate::dropped));
    EXPECT_FALSE(reports(surface("x,y,z\n# metres\n1,2,3\n", "scan.csv"), "text", Fate::dropped));
}

ReadOptions with_columns(const std::string &list) { return {.columns = *parse_columns(list)}; }

TEST(Columns, TakeThePlaceOfNamesAndGuesses) {
    const std::string rows = "1 2 3 7 10 20 30 9\n4 5 6 8 40 50 60 9\n";
    for (const std::string head : {"", "u v w q a b c d\n", "# x y z r g b i k\n"}) {
        ReadOptions options = with_columns("z,y,X,-,r,g,b,quality");
        options.fields = {"Quality"};
        const Result<Surface> s = read(head + rows, "scan.txt", options);
        ASSERT_TRUE(s) << s.error().message;
        EXPECT_EQ(s->positions[1], glm::dvec3(6, 5, 4));
        EXPECT_EQ(s->colours[1], (Rgb8{40, 50, 60}));
        EXPECT_EQ(s->field_values[0][1].number, 9);
        EXPECT_EQ(note_of(*s, "columns"), "as --columns names them");
        EXPECT_TRUE(std::none_of(s->report.begin(), s->report.end(),
                                 [](const AttributeReport &line) { return line.fate == Fate::dropped; }));
    }
    // Columns beyond the list are named, rows that are too short refused.
    EXPECT_TRUE(reports(*read(rows, "scan.txt", with_columns("x,y,z")), "column 4", Fate::dropped));
    EXPECT_TRUE(has(read("1 2 3\n", "scan.txt", with_columns("x,y,z,i")).error().message, "--columns has 4 names"));
    EXPECT_TRUE(reports(*read("a b c\nm m m\n1 2 3\n", "scan.txt", with_columns("x,y,z")), "text", Fate::dropped));
}

TEST(Columns, ListsAndFilesThatDoNotFitAreRefused) {
    for (const char *list : {"", "x,y", "x,y,z,", "x,y,z,x", "x,y,z,label,Label", "a,b,c"})
        EXPECT_FALSE(parse_columns(list)) << list;
    EXPECT_TRUE(parse_columns("x, y, z, -, -"));
    const Error error = read(pcd("x y z", "4 4 4", "F F F", 1, "ascii\n1 2 3\n"), "a", with_columns("x,y,z")).error();
    EXPECT_EQ(error.code, ErrorCode::usage);
    EXPECT_TRUE(has(error.message, "--columns is for tables"));
}

TEST(Pcd, BytesBehindTheLastPointAreReported) {
    const std::string file = pcd("x y z", "4 4 4", "F F F", 1, "binary\n" + std::string(12, '\0'));
    EXPECT_FALSE(reports(surface(file, "scan"), "end of file", Fate::dropped));
    EXPECT_TRUE(has(note_of(surface(file + "more", "scan"), "end of file"), "4 bytes"));
}

TEST(Pcd, AFieldOfSeveralNumbersIsNotKept) {
    const std::string file = "VERSION 0.7\nFIELDS x y z hist label\nSIZE 4 4 4 4 4\nTYPE F F F F U\nCOUNT 1 1 1 3 1\n"
                             "WIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3 5 6 7 8\n";
    const Result<Surface> s = read(file, "scan.pcd", {.fields = {"hist", "label"}});
    ASSERT_TRUE(s.ok());
    EXPECT_TRUE(s->field_values[0].empty());
    ASSERT_EQ(s->field_values[1].size(), 1U);
    EXPECT_EQ(s->field_values[1].front().number, 8);
}

TEST(Pcd, TextBinaryAndCompressedAgree) {
    const std::string text = pcd("x y z rgb", "4 4 4 4", "F F F U", 2, "ascii\n1 2 3 16711935\n-4 5.5 6 255\n");
    std::string rows, columns;
    const std::vector<std::vector<float>> places{{1, 2, 3}, {-4, 5.5F, 6}};
    const std::vector<std::uint32_t> colours{0xFF00FF, 0xFF};
    for (std::size_t i = 0; i < 2; ++i)
        rows += raw(places[i][0]) + raw(places[i][1]) + raw(places[i][2]) + raw(colours[i]);
    for (std::size_t axis = 0; axis < 3; ++axis)
        columns += raw(places[0][axis]) + raw(places[1][axis]);
    columns += raw(colours[0]) + raw(colours[1]);
    // LZF may consist of literal bytes alone.
    const std::string packed = std::string(1, static_cast<char>(columns.size() - 1)) + columns;
    const std::string binary = pcd("x y z rgb", "4 4 4 4", "F F F U", 2, "binary\n" + rows);
    const std::string compressed = pcd("x y z rgb", "4 4 4 4", "F F F U", 2,
                                       "binary_compressed\n" + raw(static_cast<std::uint32_t>(packed.size())) +
                                           raw(static_cast<std::uint32_t>(columns.size())) + packed);
    for (const std::string &file : {text, binary, compressed}) {
        const Surface s = surface(file, "scan");
        ASSERT_EQ(s.positions.size(), 2U);
        EXPECT_EQ(s.positions[1], glm::dvec3(-4, 5.5, 6));
        EXPECT_EQ(s.colours[0], (Rgb8{255, 0, 255}));
        for (std::size_t size = 60; size + 2 < file.size(); ++size) {
            const Result<Surface> cut = read(file.substr(0, size), "scan.pcd");
            EXPECT_TRUE(!cut.ok() || note_of(*cut, "end of file") != "no such line") << size;
        }
    }
    // A colour packed in a float.
    const float packed_colour = std::bit_cast<float>(std::uint32_t{0x123456});
    EXPECT_EQ(
        surface(pcd("x y z rgb", "4 4 4 4", "F F F F", 1, "binary\n" + std::string(12, '\0') + raw(packed_colour)),
                "scan")
            .colours[0],
        (Rgb8{0x12, 0x34, 0x56}));
}

TEST(Pcd, LzfCopiesEarlierBytes) {
    // One zero, then 23 copies of it: three coordinates of two points.
    const std::string packed{'\0', '\0', static_cast<char>(7 << 5), static_cast<char>(23 - 9), '\0'};
    const auto file = [&](const std::string &data, std::uint32_t size) {
        return pcd("x y z", "4 4 4", "F F F", 2,
                   "binary_compressed\n" + raw(static_cast<std::uint32_t>(data.size())) + raw(size) + data);
    };
    EXPECT_EQ(surface(file(packed, 24), "scan").positions[1], glm::dvec3(0));
    EXPECT_TRUE(has(refusal(file(packed, 23), "scan"), "does not fit the header"));
    EXPECT_TRUE(has(refusal(file({'\x20', '\0', '\0', '\0'}, 24), "scan"), "LZF"));
}

TEST(Pcd, MissingReturnsAndTheScannersPlace) {
    const Surface s = surface(
        pcd("x y z intensity", "4 4 4 4", "F F F F", 3, "ascii\n1 2 3 5\nnan nan nan 0\n4 5 6 9\n", "0 0 9 1 0 0 0"),
        "scan");
    EXPECT_EQ(s.positions.size(), 2U);
    EXPECT_EQ(s.dropped_vertices, 0U);
    EXPECT_EQ(note_of(s, "x y z"), "positions; 1 row without coordinates left out");
    ASSERT_EQ(s.stations.size(), 1U);
    EXPECT_EQ(s.stations[0], glm::dvec3(0, 0, 9));
    EXPECT_EQ(s.station_ids, (std::vector<std::uint16_t>{0, 0}));
    EXPECT_NE(note_of(s, "intensity"), "no such line");
    EXPECT_TRUE(has(refusal(pcd("x y", "4 4", "F F", 1, "ascii\n1 2\n"), "scan"), "no x, y and z"));
    EXPECT_TRUE(has(refusal(pcd("x y z", "4 4 3", "F F F", 1, "ascii\n1 2 3\n"), "scan"), "'z' has no type"));
    EXPECT_TRUE(has(refusal(pcd("x y z", "4 4 4", "F F F", 1, "ascii\n1 2      \n"), "scan"), "fewer numbers"));
    EXPECT_TRUE(has(refusal(pcd("x y z", "4 4 4", "F F F", 2000000000, "binary\n"), "scan"), "too small"));
    EXPECT_TRUE(has(refusal(pcd("x y z", "4 4 4", "F F F", 1, "zip\n0123456789ab"), "scan"), "DATA 'zip'"));
}

TEST(TextCloud, SeparatorsAndNames) {
    for (const char *text : {"1 2 3\n4 5 6\n", "1,2,3\r\n4,5,6\r\n", "1;2;3\n4;5;6\n", "# made by hand\n1\t2\t3\n4 5 6",
                             "X Y Z\n1 2 3\n4 5 6\n", "\"X\",\"Y\",\"Z\"\n1,2,3\n4,5,6\n", "//Z X Y\n3 1 2\n6 4 5\n",
                             "2\n1 2 3\n4 5 6\n", "1\n1 2 3\n1\n4 5 6\n"}) {
        const Surface s = surface(text, "scan.xyz");
        ASSERT_EQ(s.positions.size(), 2U) << text;
        EXPECT_EQ(s.positions[0], glm::dvec3(1, 2, 3)) << text;
        EXPECT_EQ(s.positions[1], glm::dvec3(4, 5, 6)) << text;
    }
    EXPECT_EQ(surface("1,5;2;3\n4;5;6,25\n", "scan.csv").positions[1], glm::dvec3(4, 5, 6.25));
    const Surface named = surface("//X Y Z Rf Gf Bf Intensity Time\n1\n1 2 3 1 0.5 0 7 9\n", "scan.asc");
    EXPECT_EQ(named.colours[0], (Rgb8{255, 128, 0}));
    EXPECT_EQ(note_of(named, "columns Time"), "measurements that are not shown; --field NAME keeps one");
}

TEST(TextCloud, ACommaIsADecimalSignWhereItSeparatesNothing) {
    for (const char *text : {"1,5\t2\t-3,25\n4\t5,5\t6\n", "1,5 2 -3,25\n4 5,5 6\n", "1,5;2;-3,25\n4;5,5;6\n",
                             "2\nX\tY\tZ\n1,5\t2\t-3,25\n4\t5,5\t6\n", "1,5; 2; -3,25\n 4; 5,5; 6\n"}) {
        const Surface s = surface(text, "scan.txt");
        ASSERT_EQ(s.positions.size(), 2U) << text;
        EXPECT_EQ(s.positions[0], glm::dvec3(1.5, 2, -3.25)) << text;
        EXPECT_EQ(s.positions[1], glm::dvec3(4, 5.5, 6)) << text;
        EXPECT_EQ(note_of(s, "decimal sign"), "a comma") << text;
    }
    // Commas separate where more than one is in a word, or one at its end.
    for (const char *text : {"1, 2, 3, 4, 5, 6\n", "1 ,2 ,3 ,4 ,5 ,6\n", "1,2,3,4,5,6\n"})
        EXPECT_EQ(surface(text, "scan.txt").positions[0], glm::dvec3(1, 2, 3)) << text;
    for (const char *text : {"1,234.5 2,345.6 3,4\n", "1,5, 2,5, 3,5\n", "1,5, 2,5, 3,5, 17\n", "1,200.5;2;3\n",
                             "1,234,567.0 2,345,678.0 3,456,789.5\n", "7.5 8.25 1,5\n", "2.500;1,5;3\n"})
        EXPECT_TRUE(has(refusal(text, "scan.txt"), "line 1: it is not clear whether the comma of '1,")) << text;
    // Nor is a number cut at a blank or at a comma in quotes.
    for (const char *text : {"1,2,3 4,5,6\n", "1 000;2;3\n", "x,y,z\n\"1,5\",2,3\n", "\"1,000\",2,3\n",
                             "x\ty\tz\n1 000\t2\t3\n", "1.5;2;3\n1,5;2;3\n"})
        EXPECT_FALSE(read(text, "scan.csv")) << text;
    // Also where only later rows have one.
    std::string whole, comment = "# ";
    for (int i = 0; i < 20000; ++i)
        whole += "1;2;3\n";
    EXPECT_EQ(surface(whole + "4;5,5;6\n", "scan.csv").positions.back(), glm::dvec3(4, 5.5, 6));
    std::replace(whole.begin(), whole.end(), ';', '\t');
    EXPECT_EQ(surface(whole + "4\t5,5\t6\n", "scan.txt").positions.back(), glm::dvec3(4, 5.5, 6));
    comment.append(70000, '-');
    EXPECT_EQ(surface(comment + "\n1,5;2;3\n", "scan.csv").positions.back(), glm::dvec3(1.5, 2, 3));
    EXPECT_EQ(surface("#x,y,z,a,b\n1,5 2,5 3,5 7 8\n", "scan.txt").positions.back(), glm::dvec3(1.5, 2.5, 3.5));
    EXPECT_TRUE(has(refusal("1 2 3\n1,5 2 3\n4,4,4\n", "scan.txt"), "'1 2 3' begins neither"));
}

TEST(TextCloud, EmptyCellsAreMissingValues) {
    for (const char *text :
         {"x,y,z,GPS Time,r,g,b\n1,2,3,,10,20,30\n,5,6,7,1,2,3\n7,8,9,4,5,,\n,,,,,,\n",
          "\"x\";\"y\";\"z\";\"GPS Time\";r;g;b\n1;2;3;;10;20;30\n;5;6;7;1;2;3\n7;8;9;4;5;;\n",
          "x\ty\tz\tGPS Time\tr\tg\tb\n1\t2\t3\t\t10\t20\t30\n\t5\t6\t7\t1\t2\t3\n7\t8\t9\t4\t5\t\t\n"}) {
        const Surface s = surface(text, "scan.csv", {.fields = {"gps_time"}, .progress = {}});
        ASSERT_EQ(s.positions.size(), 2U) << text;
        EXPECT_EQ(s.positions[1], glm::dvec3(7, 8, 9)) << text;
        EXPECT_TRUE(std::isnan(s.field_values[0][0].number)) << text;
        EXPECT_EQ(s.field_values[0][1].number, 4) << text;
        EXPECT_EQ(s.colours[0], (Rgb8{10, 20, 30})) << text;
        EXPECT_EQ(s.colours[1], Rgb8{}) << text;
        EXPECT_EQ(note_of(s, "x y z"), "positions; 1 row without coordinates left out") << text;
        EXPECT_EQ(note_of(s, "colours"), "sRGB, 8 bits; 1 point without a colour is black") << text;
        EXPECT_EQ(note_of(s, "empty cells"), "4 cells: no value of that point") << text;
    }
    const Surface bare = surface("1,2,,4\n5,6,7,8\n9,9,9,9\n", "scan.csv");
    EXPECT_EQ(bare.positions[0], glm::dvec3(5, 6, 7)); // the first row has no z
    // A separator at the end of all rows separates nothing.
    EXPECT_EQ(surface("1,2,3,\n4,5,6,\n", "scan.csv").report.size(), 1U);
    EXPECT_EQ(surface("x,y,z,,\n1,2,3,,\n4,5,6,,\n", "scan.csv").report.size(), 1U);
    EXPECT_EQ(surface("\"1.5\",\" 2 \",'3'\n", "scan.csv").positions[0], glm::dvec3(1.5, 2, 3));
    EXPECT_EQ(surface("x,y,z,a\n1,2,3,\"\"\n", "scan.csv").positions[0], glm::dvec3(1, 2, 3));
    // Between tabs too, also without names, unless several tabs align all rows.
    EXPECT_EQ(surface("0\t\t3\t10\n1\t2\t\t10\n4\t5\t6\t7\n", "scan.txt").positions[0], glm::dvec3(4, 5, 6));
    EXPECT_EQ(surface("0\t\t3\t\t10\n1\t\t2\t\t10\n", "scan.txt").positions[1], glm::dvec3(1, 2, 10));
    EXPECT_TRUE(has(refusal("0\t2\t3\n1\t2\t\t10\n", "scan.txt"), "a row of 4 numbers, others have 3"));
    const Surface indexed =
        surface("\tx\ty\tz\tlabel\n0\t1.5\t2\t3\t\n1\t4\t5\t6\t\n", "scan.txt"); // as pandas writes it
    EXPECT_EQ(indexed.positions[0], glm::dvec3(1.5, 2, 3));
    const std::string many(200, ',');
    EXPECT_EQ(surface("1,2,3" + many + "\n", "scan.csv").positions[0], glm::dvec3(1, 2, 3));
}

TEST(TextCloud, CommentsAreSaidAndErrorsOfSpreadsheetsAreNone) {
    const Surface s = surface("# x y z\n1 2 3 # first\n//2 2 2\n4 5 6\n", "scan.txt");
    EXPECT_EQ(s.positions.size(), 2U);
    EXPECT_EQ(note_of(s, "comments"), "2 lines behind the first point, or end of a line, that begins with # or //");
    for (const char *text :
         {"x,y,z\n1,2,3\n#DIV/0!,2,3\n", "1,2,3\n1,2,#REF!\n", "1,2,3,#ff0000\n", "1\t2\t3\n#NV\t2\t3\n",
          "x\ty\tz\n1\t2\t#####\n1\t2\t3\n", "x,y,z\nNA,NA,NA\nNA,NA,NA\nNA,NA,NA\nNA,NA,NA\n1,2,3\n",
          "x,y,z\n0 m,1 m,2 m\n", "x,y,z\n\"0,5\",\"2,5\",\"3,5\"\n1,2,3\n", "1,2,3\n#N/A,1,2\n"})
        EXPECT_TRUE(has(refusal(text, "scan.csv"), "is not a number")) << text;
    EXPECT_EQ(surface("# Columns: X Y Z\n1 2 3\n", "scan.txt").report.size(), 1U);
    EXPECT_EQ(surface("sep=;\nx;y;z\n1;2;3\n", "scan.csv").report.size(), 1U);
    const std::string longest = "# " + std::string(1 << 20, 'a'), many = [] {
        std::string names = "# ";
        for (int i = 0; i < 200000; ++i)
            names += "a ";
        return names;
    }();
    EXPECT_EQ(surface(longest + "\n" + many + "\n1 2 3\n", "scan.txt").positions.size(), 1U);
}

TEST(TextCloud, PackedColoursThatAreNoneAreCounted) {
    const Surface s = surface("x,y,z,rgb\n1,2,3,16711680\n1,2,3,\n1,2,3,nan\n1,2,3,1e300\n", "scan.csv");
    EXPECT_EQ(s.colours[0], (Rgb8{255, 0, 0}));
    EXPECT_EQ(note_of(s, "colours"), "sRGB, 8 bits; 3 points without a colour are black");
}

// 200, 100, 30 is 0xC8641E: as unsigned and signed numbers with and without an opacity, of 64 bits, and as a float.
TEST(TextCloud, PackedColoursAreTheLowBitsOfANumberOrAFloat) {
    const Rgb8 expected{200, 100, 30};
    for (const std::string bits : {"13132830", "-3644386", "4291322910", "4308100126", "13132830.0", "1.3132830e7",
                                   "1.84030145e-38", "-1.84030145e-38"}) {
        EXPECT_EQ(surface(std::string("x,y,z,rgb\n1,2,3,").append(bits).append("\n4,5,6,0\n"), "scan.csv").colours[0],
                  expected)
            << bits;
        for (const char *type : {"F F F I", "F F F U", "F F F F"})
            EXPECT_EQ(surface(pcd("x y z rgba", "4 4 4 4", type, 1, "ascii\n1 2 3 " + bits + "\n"), "scan").colours[0],
                      expected)
                << type << " " << bits;
    }
    const std::string place(12, '\0');
    EXPECT_EQ(surface(pcd("x y z rgb", "4 4 4 4", "F F F I", 1, "binary\n" + place + raw(-3644386)), "scan").colours[0],
              expected);
    EXPECT_EQ(
        surface(pcd("x y z rgb", "4 4 4 8", "F F F I", 1, "binary\n" + place + raw(std::int64_t{-3644386})), "scan")
            .colours[0],
        expected);
}

TEST(TextCloud, AFewOddColoursDoNotChangeTheRangeOfAll) {
    std::string bytes, parts, wide;
    for (int i = 0; i < 300; ++i) {
        bytes += i == 7 ? "1 2 3 256 -1 0\n" : "1 2 3 200 100 50\n";
        parts += i == 7 ? "1 2 3 1.2 0 0\n" : "1 2 3 0.5 1 0\n";
        wide += i == 7 ? "1 2 3 40000 257 0\n" : "1 2 3 0 0 0\n"; // most points have none
    }
    const std::string names = "x y z r g b\n";
    EXPECT_EQ(surface(names + bytes, "scan.txt").colours[0], (Rgb8{200, 100, 50}));
    EXPECT_EQ(note_of(surface(names + bytes, "scan.txt"), "colours"), "sRGB, 8 bits; 1 colour outside clamped");
    EXPECT_EQ(surface(names + parts, "scan.txt").colours[0], (Rgb8{128, 255, 0}));
    EXPECT_EQ(surface(names + wide, "scan.txt").colours[7], (Rgb8{156, 1, 0}));
    std::string dark; // of whole numbers
    for (int i = 0; i < 300; ++i)
        dark += i == 7 ? "1 2 3 200 100 50\n" : "1 2 3 1 1 0\n";
    EXPECT_EQ(surface(names + dark, "scan.txt").colours[0], (Rgb8{1, 1, 0}));
}

TEST(TextCloud, TextIsSkippedWhereTheUserSaysSo) {
    EXPECT_TRUE(
        has(refusal("x,y,z,kind\n1,2,3,tall tree\n", "x.csv"), "line 2: 'tall tree' in column 4 is not a number; '-'"));
    EXPECT_TRUE(has(refusal("id,x,y,z\nP1,1,2,3\n", "x.csv"),
                    "line 2: 'P1' in column 1 is not a number; '-' in --columns skips"));
    for (const char *text :
         {"id,x,y,z,kind\nP1,1,2,3,tall tree\nP2,4,5,6,\n", "P1,1,2,3,house\nP2,4,5,6,7\n",
          "\"P,1\",1,2,3,\"a, b 5\"\n\"P,2\",4,5,6,\"7,8\"\n", "\"P 1\" 1 2 3 'a 5'\nP2 4 5 6 7\n",
          "P1,1,2,3,\"5\"\" pipe, #4\"\nP2,4,5,6,\n", "01.02.2024;1;2;3;v1.2\n02.02.2024;4,0;5,0;6,0;7\n",
          "id\tx\ty\tz\tkind\nP1\t1\t2\t3\tTree 10\nP 2\t4\t5\t6\t10\n", "P1 1 2 3 house\nP2 4 5 6 tree\n"}) {
        const Surface s = surface(text, "scan.csv", {.columns = {"-", "x", "y", "z", "-"}, .progress = {}});
        ASSERT_EQ(s.positions.size(), 2U) << text;
        EXPECT_EQ(s.positions[1], glm::dvec3(4, 5, 6)) << text;
    }
    EXPECT_EQ(surface("1 2 3 4\n5 6 7 8\n", "scan.dat", {.columns = {"x", "y", "-", "z"}, .progress = {}}).positions[1],
              glm::dvec3(5, 6, 8));
}

TEST(TextCloud, ColumnsAreGuessedByContent) {
    const Surface colours = surface("1 2 3 255 128 0\n4 5 6 1 2 3\n", "scan.txt");
    EXPECT_EQ(colours.colours[0], (Rgb8{255, 128, 0}));
    EXPECT_EQ(note_of(colours, "columns"), "guessed as x, y, z, r, g, b");
    const Surface normals = surface("1 2 3 0 0 1\n4 5 6 0 -0.6 0.8\n", "scan.xyz");
    EXPECT_EQ(normals.normals[0], glm::vec3(0, 0, 1));
    const Surface pts = surface("2\n1 2 3 -1613 52 70 64\n4 5 6 -1000 1 2 3\n", "scan.pts");
    EXPECT_EQ(pts.colours[0], (Rgb8{52, 70, 64}));
    EXPECT_EQ(note_of(pts, "columns"), "guessed as x, y, z, intensity, r, g, b");
    EXPECT_EQ(note_of(surface("1 2 3 0.5\n4 5 6 0.7\n", "scan.xyz"), "columns"), "guessed as x, y, z, intensity");
    const Surface both = surface("1 2 3 10 20 30 0 0 1\n4 5 6 1 2 3 1 0 0\n", "scan.xyz");
    EXPECT_EQ(both.colours.size(), 2U);
    EXPECT_EQ(both.normals.size(), 2U);
}

TEST(TextCloud, FourColumnsOfBytesAreAColourWhereTheLastIsNone) {
    const auto guess = [](std::string_view row, std::string_view next, const std::string &places = "1 2 3 ") {
        std::string table;
        for (const std::string_view each : {row, next, row, next})
            table.append(places).append(each).append("\n");
        return note_of(surface(table, "scan.xyz"), "columns");
    };
    const std::string colour = "guessed as x, y, z, r, g, b, column 7", pts = "guessed as x, y, z, intensity, r, g, b";
    EXPECT_EQ(guess("200 100 30 255", "10 20 30 255"), colour);
    EXPECT_EQ(guess("200 100 30 128", "10 20 30 128"), colour) << "any constant";
    EXPECT_EQ(guess("200 100 30 0.5", "10 20 30 0.7"), colour);
    EXPECT_EQ(guess("200 100 30 300", "10 20 30 7"), colour);
    const std::string or_pts = "; the last four may also be an intensity and a colour",
                      or_colour = "; the last four may also be a colour and a measurement";
    EXPECT_EQ(guess("200 100 30 5", "10 20 30 7"), colour + or_pts) << "a label";
    EXPECT_EQ(guess("200 100 30 90", "10 20 30 7"), pts + or_colour);
    EXPECT_EQ(guess("200 128 128 128", "10 128 128 128"), pts + or_colour) << "an intensity, and one grey for all";
    EXPECT_EQ(guess("7 200 100 30", "7 10 20 30"), pts + or_colour) << "one intensity for all";
    EXPECT_EQ(guess("7 200 100 255", "7 10 20 255"), colour) << "opaque";
    EXPECT_EQ(guess("0 0 1 200 100 30 9", "1 0 0 10 20 30 9"), "guessed as x, y, z, nx, ny, nz, r, g, b, column 10");
    const AttributeReport line = report(surface("1 2 3 10 20 30\n4 5 6 1 2 3\n", "scan.txt"), "columns");
    EXPECT_EQ(line.warning, Warning::guessed_columns);
    EXPECT_EQ(report(surface("1 2 3\n4 5 6\n", "scan.txt"), "columns").warning, Warning::none);
}

TEST(TextCloud, AFirstColumnThatCountsIsNoCoordinate) {
    for (const std::string text : {"0 5 6 7\n1 8 9 7\n2 5 5 5\n", "1,5,6,7\n2,8,9,7\n3,5,5,5\n"}) {
        const Surface s = surface(text, "scan.xyz");
        EXPECT_EQ(s.positions[1], glm::dvec3(8, 9, 7));
        EXPECT_EQ(note_of(s, "columns"), "guessed as number, x, y, z; the first counts the rows");
    }
    EXPECT_EQ(note_of(surface("1 5 6 7.5 200 100 50\n2 8 9 7 1 2 3\n3 5 5 5 4 5 6\n", "scan.csv"), "columns"),
              "guessed as number, x, y, z, r, g, b; the first counts the rows");
    EXPECT_EQ(surface("1 5 6 7\n2 8 9 7\n4 5 5 5\n", "scan.xyz").positions[1], glm::dvec3(2, 8, 9));
    EXPECT_EQ(surface("2 5 6 7\n3 8 9 7\n4 5 5 5\n", "scan.xyz").positions[1], glm::dvec3(3, 8, 9));
    EXPECT_EQ(surface("1 5 6\n2 8 9\n3 5 5\n", "scan.xyz").positions[1], glm::dvec3(2, 8, 9)) << "it is x";
    EXPECT_EQ(surface("1 5 6 7 8 9\n2 8 9 7 8 9\n3 5 5 7 8 9\n", "scan.xyz").positions[1], glm::dvec3(2, 8, 9))
        << "a colour is behind it";
}

TEST(TextCloud, WhatIsNoTableIsRefused) {
    EXPECT_TRUE(has(refusal("hello world\n", "x.txt"), "line 1: 'hello' begins neither a row"));
    EXPECT_TRUE(has(refusal("# nothing\n", "x.txt"), "no row of three numbers"));
    EXPECT_TRUE(has(refusal("1 2 3\n1 2\n", "x.xyz"), "line 2: a row of 2 numbers, others have 3"));
    EXPECT_TRUE(has(refusal("1 2 3\n1 2 x\n", "x.xyz"), "line 2: 'x' in column 3 is not a number"));
    EXPECT_TRUE(has(refusal("3\n1 2 3\n4 5 6\n", "x.pts"), "announces 3 points, and 2 follow"));
    EXPECT_TRUE(has(refusal("1\n1 2 3\n4 5 6\n", "x.pts"), "behind the 1 that are announced"));
    EXPECT_TRUE(has(refusal("X Y Z R\n1 2 3\n", "x.csv"), "a row of 3 numbers below 4 names"));
    EXPECT_TRUE(has(refusal(std::string("1 2 3\0\n", 7), "x.txt"), "NUL"));
    EXPECT_TRUE(has(refusal("[Expe/PointSet/Binary/0.1]\n", "x.pts"), "Expe point set"));
}

} // namespace
