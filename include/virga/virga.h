/* Virga: rain onto frames that the caller holds in memory. A small C interface to what `virga rain` does to a plate.
 *
 *   virga_shot* shot = NULL;
 *   if (virga_shot_create(1920, 1080, 24.0, &shot) != VIRGA_OK) fail(virga_error_sentence());
 *   virga_shot_set(shot, "rate", "25");
 *   virga_shot_set(shot, "depth", "street_depth.####.exr");
 *   for (int64_t frame = 0; frame < 96; ++frame)
 *       if (virga_shot_render(shot, frame, plate[frame], 0, beauty, 0, NULL, 0) != VIRGA_OK) ...
 *   virga_shot_release(shot);
 *
 * Pixels are float R G B A, scene-linear, premultiplied, top row first; they stay the caller's. A stride is the number
 * of bytes from one row to the next: 0 for rows without gaps, negative for pictures that are kept bottom row first (the
 * pointer is then to the top row, which lies last in memory).
 *
 * A rendered frame depends on the settings, the frame number and the plate's pixels alone, so frames may be asked for
 * in any order. Frame n is exposed from n / fps seconds on.
 *
 * Threads: different shots may be used from different threads at once. Calls on one shot take turns; any thread may
 * make them. A shot renders on a thread of its own, so the caller's OpenGL context stays as it is.
 *
 * Errors: every function that can fail returns a code, and virga_error_sentence() then says in one sentence what was
 * wrong, naming the thing, the value and what is allowed. Nothing is thrown, printed or aborted.
 */
#ifndef VIRGA_VIRGA_H
#define VIRGA_VIRGA_H

#include <stddef.h>
#include <stdint.h>

#if defined(VIRGA_BUILDS_LIBRARY)
#define VIRGA_API __attribute__((visibility("default")))
#else
#define VIRGA_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The values are the exit codes of the command line. */
typedef enum virga_error {
    VIRGA_OK = 0,
    VIRGA_ERROR_INTERNAL = 1,         /* a fault of Virga's */
    VIRGA_ERROR_INVALID_ARGUMENT = 2, /* a setting, a size or a pointer */
    VIRGA_ERROR_INPUT = 3,            /* a file that is missing, damaged, of the wrong kind or size */
    VIRGA_ERROR_GRAPHICS = 4,         /* no usable OpenGL 4.5 device */
    VIRGA_ERROR_OUTPUT = 5            /* a file that cannot be written */
} virga_error;

/* What was wrong with the last failed call on this thread; "" if none has failed. Valid until the next call. */
VIRGA_API const char* virga_error_sentence(void);

/* Version of the library as text, "1.2.3". */
VIRGA_API const char* virga_version(void);

/* How a parameter's text reads. */
typedef enum virga_type {
    VIRGA_NUMBER = 0,         /* "25" */
    VIRGA_NUMBER_OR_AUTO = 1, /* "180" or "auto" */
    VIRGA_WHOLE_NUMBER = 2,   /* "7" */
    VIRGA_SWITCH = 3,         /* "true" or "false" */
    VIRGA_TEXT = 4,           /* a file name, or one of `choices` */
    VIRGA_TWO_NUMBERS = 5,    /* "1.5,-2" */
    VIRGA_COLOR_OR_AUTO = 6   /* "0.2,0.2,0.25", scene-linear, or "auto" */
} virga_type;

/* One row of the parameter table. Later versions may add fields at the end. */
typedef struct virga_parameter {
    const char* name;
    const char* group; /* "rain", "camera", "light", "scene", "grade", "file" */
    const char* unit;  /* "mm/h"; "x" is a plain multiplier; "" for none */
    virga_type type;
    double least, most; /* of each number; 0, 0 for texts and switches */
    const char* default_text;
    const char* choices; /* words allowed, separated by '|'; NULL if the text is free */
    const char* help;    /* one line */
} virga_parameter;

/* The table, in the order of the documentation. Parameters of the group "file" are about reading and writing files;
 * they are accepted and change nothing here. */
VIRGA_API size_t virga_parameter_count(void);
/* A row; NULL if index is not under the count. It lives as long as the library. */
VIRGA_API const virga_parameter* virga_parameter_at(size_t index);

/* A shot: a picture size, a frame rate and settings, which start at their defaults. */
typedef struct virga_shot virga_shot;

/* width, height: 1 to 16384 pixels. frames_per_second: over 0. *shot is NULL after an error. */
VIRGA_API virga_error virga_shot_create(int width, int height, double frames_per_second, virga_shot** shot);
/* Waits for a frame that is being rendered. NULL is allowed. */
VIRGA_API void virga_shot_release(virga_shot* shot);

/* Sets a parameter from text as on the command line. Files are looked at when the next frame is rendered. */
VIRGA_API virga_error virga_shot_set(virga_shot* shot, const char* name, const char* text);
/* The parameter's present value; *text is valid until the next call on the shot. */
VIRGA_API virga_error virga_shot_get(virga_shot* shot, const char* name, const char** text);

/* Which device renders: "auto" (the default: a GPU if there is one), "cpu", "gpu", or a number of `virga info`. */
VIRGA_API virga_error virga_shot_set_device(virga_shot* shot, const char* device);

/* "grade-from" compares a still with the plate: give it a few frames of the plate, spread over the shot, before
 * rendering. Without them such a shot is an error. The pixels are copied. */
VIRGA_API virga_error virga_shot_add_plate_sample(virga_shot* shot, const float* plate, ptrdiff_t plate_stride);

/* *is_identity: 1 if the settings change no pixel of any frame; render then copies and opens no device. */
VIRGA_API virga_error virga_shot_is_identity(virga_shot* shot, int* is_identity);

/* Renders one frame over `plate`, width x height RGBA, into `beauty`, which may be `plate` itself. `rain`, if it is not
 * NULL, gets the strokes alone, premultiplied, so that they can be graded apart and put over the rest. The first frame
 * after a change of settings opens files and the device and takes longer. */
VIRGA_API virga_error virga_shot_render(virga_shot* shot, int64_t frame, const float* plate, ptrdiff_t plate_stride,
                                        float* beauty, ptrdiff_t beauty_stride, float* rain, ptrdiff_t rain_stride);

#ifdef __cplusplus
}
#endif

#endif
