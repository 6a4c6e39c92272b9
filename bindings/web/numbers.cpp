// Functions of the C library that JavaScript has, too. The library's own take 14 KB of the download: tables, and
// arithmetic of 128 bits. What is drawn depends on none of them to the last bit.

#include <cmath>

extern "C" {

// callbacks.js
double pbm_web_power(double base, double exponent);
double pbm_web_logarithm(double number);
double pbm_web_number(const char *text, int *length);

double pow(double base, double exponent) { return pbm_web_power(base, exponent); }

double log(double number) { return pbm_web_logarithm(number); }

// `text` is a decimal number and nothing else, as JSON's reader has it.
double strtod(const char *text, char **end) {
    int length = 0;
    const double number = pbm_web_number(text, &length);
    if (end != nullptr)
        *end = const_cast<char *>(text) + length;
    return number;
}

// For angles of more than 1.6 million radians, which the library reduces to the last bit, with tables of 3 KB.
// `x`: parts of an angle, of 24 bits each; `exponent`: of the first.
int __rem_pio2_large(double *x, double *remainder, int exponent, int parts, int) {
    double angle = 0;
    for (int part = 0; part < parts; ++part)
        angle += std::ldexp(x[part], exponent - 24 * part);
    angle = std::fmod(angle, 2 * M_PI);
    const int quarters = static_cast<int>(std::lround(angle / M_PI_2));
    remainder[0] = angle - quarters * M_PI_2;
    remainder[1] = 0;
    return quarters & 3;
}

// The JSON library prints into texts of exceptions that nobody reads. Ours uses std::to_chars.
int snprintf(char *text, std::size_t size, const char *, ...) {
    if (size > 0)
        *text = '\0';
    return 0;
}

// There are no system calls whose errors could have texts.
int strerror_r(int, char *text, std::size_t size) {
    if (size > 0)
        *text = '\0';
    return 0;
}

// The library has these in one object with strtod.
float strtof(const char *text, char **end) { return static_cast<float>(strtod(text, end)); }
long double strtold(const char *text, char **end) { return strtod(text, end); }
}
