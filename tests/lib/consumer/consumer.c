/* What a C program sees of the installed library. Prints what is wrong and fails. */
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <virga/virga.h>

enum { width = 64, height = 36, floats = width * height * 4 };

static int failures = 0;

#define CHECK(condition)                                                                        \
    do {                                                                                        \
        if (!(condition)) {                                                                     \
            printf("line %d: not so: %s (%s)\n", __LINE__, #condition, virga_error_sentence()); \
            ++failures;                                                                         \
        }                                                                                       \
    } while (0)

/* A frame over packed or padded RGBA floats. rain may be NULL. */
static virga_error render(virga_shot* shot, int64_t frame, float* plate, ptrdiff_t plate_stride, float* beauty,
                          ptrdiff_t beauty_stride, float* rain, ptrdiff_t rain_stride)
{
    virga_picture from = virga_picture_default(), to = virga_picture_default(), strokes = virga_picture_default();
    virga_request request = virga_request_default();
    from.planes[0] = plate, from.row_stride[0] = plate_stride;
    to.planes[0] = beauty, to.row_stride[0] = beauty_stride;
    strokes.planes[0] = rain, strokes.row_stride[0] = rain_stride;
    request.frame = (double)frame;
    request.plate = &from;
    request.beauty = &to;
    request.rain = rain != NULL ? &strokes : NULL;
    return virga_shot_render(shot, &request);
}

/* Fails unless `code` is `wanted` and the sentence names `word`. */
#define CHECK_ERROR(code, wanted, word)                        \
    do {                                                       \
        CHECK((code) == (wanted));                             \
        CHECK(strstr(virga_error_sentence(), (word)) != NULL); \
    } while (0)

static void check_table(void)
{
    size_t i;
    int has_rate = 0;
    CHECK(virga_parameter_count() > 40);
    CHECK(virga_parameter_at(virga_parameter_count()) == NULL);
    for (i = 0; i < virga_parameter_count(); ++i) {
        const virga_parameter* p = virga_parameter_at(i);
        CHECK(p != NULL && strlen(p->name) > 0 && strlen(p->group) > 0 && strlen(p->help) > 0);
        CHECK(p->default_text != NULL && p->unit != NULL);
        if (strcmp(p->name, "rate") == 0) {
            has_rate = 1;
            CHECK(p->type == VIRGA_NUMBER && strcmp(p->unit, "mm/h") == 0 && p->least == 0 && p->most > 100);
            CHECK(strcmp(p->default_text, "25") == 0);
        }
        if (strcmp(p->name, "wind") == 0) CHECK(p->type == VIRGA_TWO_NUMBERS);
        if (strcmp(p->name, "on-error") == 0) CHECK(p->type == VIRGA_TEXT && strcmp(p->choices, "stop|skip|hold") == 0);
    }
    CHECK(has_rate);
}

static void check_errors(void)
{
    virga_shot* shot = (virga_shot*)&failures;
    float pixel[4] = {0, 0, 0, 1};
    CHECK_ERROR(virga_shot_create(0, height, 24, &shot), VIRGA_ERROR_INVALID_ARGUMENT, "0 x 36");
    CHECK(shot == NULL);
    CHECK_ERROR(virga_shot_create(width, height, 0, &shot), VIRGA_ERROR_INVALID_ARGUMENT, "frames a second");
    CHECK_ERROR(virga_shot_create(width, height, 24, NULL), VIRGA_ERROR_INVALID_ARGUMENT, "NULL");

    CHECK(virga_shot_create(width, height, 24, &shot) == VIRGA_OK);
    CHECK_ERROR(virga_shot_set(shot, "rat", "3"), VIRGA_ERROR_INVALID_ARGUMENT, "did you mean 'rate'");
    CHECK_ERROR(virga_shot_set(shot, "rate", "-1"), VIRGA_ERROR_INVALID_ARGUMENT, "'-1'");
    CHECK_ERROR(virga_shot_set(shot, "rate", "nan"), VIRGA_ERROR_INVALID_ARGUMENT, "nan");
    CHECK_ERROR(virga_shot_set(NULL, "rate", "1"), VIRGA_ERROR_INVALID_ARGUMENT, "shot");
    CHECK_ERROR(render(shot, 0, NULL, 0, pixel, 0, NULL, 0), VIRGA_ERROR_INVALID_ARGUMENT, "plate");
    CHECK_ERROR(render(shot, 0, pixel, 16, pixel, 0, NULL, 0), VIRGA_ERROR_INVALID_ARGUMENT, "stride");
    virga_shot_release(shot);
    virga_shot_release(NULL);
}

static void check_settings(virga_shot* shot)
{
    const char* text = NULL;
    CHECK(virga_shot_set(shot, "wind", "1.5,-2") == VIRGA_OK);
    CHECK(virga_shot_get(shot, "wind", &text) == VIRGA_OK && strcmp(text, "1.5,-2") == 0);
    CHECK(virga_shot_set(shot, "wind", "0,0") == VIRGA_OK);
    CHECK(virga_shot_get(shot, "shutter", &text) == VIRGA_OK && strcmp(text, "auto") == 0);
}

static void check_pictures(virga_shot* shot)
{
    static float plate[floats], beauty[floats], again[floats], rain[floats], padded[floats + 4 * height];
    const ptrdiff_t row = width * 4 * (ptrdiff_t)sizeof(float);
    int i, x, y, identity = -1, strokes = 0;
    for (i = 0; i < floats; ++i) plate[i] = i % 4 == 3 ? 1.0f : 0.05f + 0.3f * (float)(i / 4 % 7) / 7.0f;

    CHECK(virga_shot_set(shot, "rate", "80") == VIRGA_OK);
    CHECK(virga_shot_set(shot, "exposure", "0.01") == VIRGA_OK);
    CHECK(virga_shot_is_identity(shot, &identity) == VIRGA_OK && identity == 0);
    CHECK(render(shot, 5, plate, 0, beauty, 0, rain, 0) == VIRGA_OK);
    CHECK(memcmp(plate, beauty, sizeof(plate)) != 0);
    for (i = 3; i < floats; i += 4) strokes += rain[i] > 0;
    CHECK(strokes > 10);

    /* The same frame after another one, with gaps between the rows: the same bits. */
    CHECK(render(shot, 9, plate, 0, again, 0, NULL, 0) == VIRGA_OK);
    CHECK(memcmp(again, beauty, sizeof(again)) != 0);
    CHECK(render(shot, 5, plate, 0, padded, row + 16, NULL, 0) == VIRGA_OK);
    for (y = 0; y < height; ++y) CHECK(memcmp(padded + y * (width + 1) * 4, beauty + y * width * 4, (size_t)row) == 0);

    /* Bottom row first in memory, in and out. */
    for (y = 0; y < height; ++y) memcpy(again + (height - 1 - y) * width * 4, plate + y * width * 4, (size_t)row);
    CHECK(render(shot, 5, again + (height - 1) * width * 4, -row, again + (height - 1) * width * 4, -row, NULL, 0) ==
          VIRGA_OK);
    for (y = 0; y < height; ++y)
        CHECK(memcmp(again + (height - 1 - y) * width * 4, beauty + y * width * 4, (size_t)row) == 0);

    /* A file that is not there is said when it is needed, and the shot can go on. */
    CHECK(virga_shot_set(shot, "env", "no_such_panorama.exr") == VIRGA_OK);
    CHECK_ERROR(render(shot, 5, plate, 0, again, 0, NULL, 0), VIRGA_ERROR_INPUT, "no_such_panorama.exr");
    CHECK(virga_shot_set(shot, "env", "") == VIRGA_OK);
    CHECK(virga_shot_set(shot, "grade-from", "still.png") == VIRGA_OK);
    CHECK_ERROR(render(shot, 5, plate, 0, again, 0, NULL, 0), VIRGA_ERROR_INVALID_ARGUMENT, "grade-from");
    CHECK(virga_shot_set(shot, "grade-from", "") == VIRGA_OK);
    CHECK(render(shot, 5, plate, 0, again, 0, NULL, 0) == VIRGA_OK);
    CHECK(memcmp(again, beauty, sizeof(again)) == 0);

    /* Nothing on: every bit as it was, also where the plate holds no number. */
    {
        static const char* const off[] = {"rate", "fog", "darken", "desaturate", "blur", "splashes"};
        const uint32_t odd_nan = 0x7fc12345u;
        for (i = 0; i < 6; ++i) CHECK(virga_shot_set(shot, off[i], "0") == VIRGA_OK);
        memcpy(&plate[100], &odd_nan, sizeof(odd_nan));
        for (x = 0; x < floats; ++x) rain[x] = 1;
        CHECK(virga_shot_is_identity(shot, &identity) == VIRGA_OK && identity == 1);
        CHECK(render(shot, 5, plate, 0, beauty, 0, rain, 0) == VIRGA_OK);
        CHECK(memcmp(plate, beauty, sizeof(plate)) == 0);
        for (x = 0; x < floats; ++x) strokes += rain[x] != 0 ? 1000000 : 0;
        CHECK(strokes < 1000000);
    }
}

/* A shot of its own on a thread of its own; *(float*)result gets the picture. */
static void* render_apart(void* result)
{
    float* picture = (float*)result;
    virga_shot* shot = NULL;
    int i, frame;
    for (i = 0; i < floats; ++i) picture[i] = i % 4 == 3 ? 1.0f : 0.1f;
    if (virga_shot_create(width, height, 24, &shot) != VIRGA_OK) return NULL;
    virga_shot_set_device(shot, "cpu");
    for (frame = 0; frame < 3; ++frame)
        if (render(shot, frame, picture, 0, picture, 0, NULL, 0) != VIRGA_OK) picture[0] = -1;
    virga_shot_release(shot);
    return picture;
}

static void check_threads(void)
{
    static float pictures[3][floats];
    pthread_t threads[2];
    int i;
    for (i = 0; i < 2; ++i) CHECK(pthread_create(&threads[i], NULL, render_apart, pictures[i]) == 0);
    for (i = 0; i < 2; ++i) CHECK(pthread_join(threads[i], NULL) == 0);
    CHECK(render_apart(pictures[2]) != NULL);
    CHECK(pictures[2][0] > 0);
    for (i = 0; i < 2; ++i) CHECK(memcmp(pictures[i], pictures[2], sizeof(pictures[2])) == 0);
}

/* With an argument: no pictures, only whether the library is found and answers. */
int main(int count, char** arguments)
{
    (void)arguments;
    virga_shot* shot = NULL;
    printf("virga %s\n", virga_version());
    CHECK(strcmp(virga_error_sentence(), "") == 0);
    check_table();
    check_errors();
    CHECK(virga_shot_create(width, height, 24, &shot) == VIRGA_OK);
    CHECK(virga_shot_set_device(shot, "cpu") == VIRGA_OK);
    check_settings(shot);
    if (count == 1) check_pictures(shot);
    virga_shot_release(shot);
    if (count == 1) check_threads();
    printf("%d failures\n", failures);
    return failures == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
