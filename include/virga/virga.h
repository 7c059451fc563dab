/* Virga: rain onto frames that the caller holds in memory. A small, stable C interface to what `virga rain` does to a
 * plate; docs/library.md has a tour and examples in C and Python.
 *
 *   virga_shot* shot = NULL;
 *   if (virga_shot_create(1920, 1080, 24.0, &shot) != VIRGA_OK) fail(virga_error_sentence());
 *   virga_shot_set(shot, "rate", "25");
 *
 *   virga_picture plate = virga_picture_default(), beauty = virga_picture_default();
 *   plate.planes[0] = pixels;
 *   beauty.planes[0] = result;
 *   virga_request request = virga_request_default();
 *   request.plate = &plate;
 *   request.beauty = &beauty;
 *   for (request.frame = 0; request.frame < 96; ++request.frame)
 *       if (virga_shot_render(shot, &request) != VIRGA_OK) fail(virga_error_sentence());
 *   virga_shot_release(shot);
 *
 * A rendered frame depends on the settings, the frame number and the plate's pixels alone, so frames may be asked for
 * in any order. Frame n is exposed from n / fps seconds on.
 *
 * Threads. Any thread may call any function at any time, but for virga_shot_release, which must be the last call on its
 * shot. Calls on one shot take turns, in no promised order. One thread of the library's own renders for all shots of
 * the process, one frame at a time with all cores or the GPU; the caller's OpenGL contexts stay as they are. Shots
 * share the device, compiled programs and panoramas' light as long as one of them lives.
 *
 * Memory. Pictures stay the caller's: the library reads and writes them during a call alone. Texts that come in are
 * UTF-8 and copied.
 *
 * Errors. Every function that can fail returns a code. What was wrong is one sentence that names the thing, the value
 * and what is allowed: of the thread's last failed call (virga_error_sentence), and of a shot (virga_shot_error).
 * Nothing is thrown, printed or aborted. A call that fails has changed nothing, but pictures that a render began to
 * write.
 */
#ifndef VIRGA_VIRGA_H
#define VIRGA_VIRGA_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(VIRGA_BUILDS_LIBRARY)
#define VIRGA_API __attribute__((visibility("default")))
#else
#define VIRGA_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Errors ---------------------------------------------------------------------------------------------------- */

/* The values are the exit codes of the command line. */
typedef enum virga_error {
    VIRGA_OK = 0,
    VIRGA_ERROR_INTERNAL = 1,         /* a fault of Virga's, or out of memory */
    VIRGA_ERROR_INVALID_ARGUMENT = 2, /* a setting, a size, a window or a pointer */
    VIRGA_ERROR_INPUT = 3,            /* a file or picture that is missing, damaged, of the wrong kind or size */
    VIRGA_ERROR_GRAPHICS = 4,         /* a fault of the graphics device that the processor cannot stand in for */
    VIRGA_ERROR_OUTPUT = 5,           /* a file that cannot be written */
    VIRGA_ERROR_CANCELLED = 130       /* by virga_shot_cancel or the progress callback; no fault */
} virga_error;

/* A shot: a picture size, a frame rate and settings, which start at their defaults. */
typedef struct virga_shot virga_shot;

/* What was wrong with the last failed call on this thread, whatever it was about; "" if none has failed. Valid until
 * the thread's next call. For what fails without a shot (virga_shot_create), and for who does not ask a shot. */
VIRGA_API const char* virga_error_sentence(void);

/* The first failure on this shot, by whichever thread, since this was asked last: its code and, unless `sentence` is
 * NULL, its sentence, valid until this is asked again. It is then forgotten; VIRGA_OK and "" if nothing failed. NULL
 * for the shot: the thread's last failed call, likewise forgotten. */
VIRGA_API virga_error virga_shot_error(virga_shot* shot, const char** sentence);

/* Version of the library as text, "1.2.3". */
VIRGA_API const char* virga_version(void);

/* ---- The parameter table ---------------------------------------------------------------------------------------- */

/* How a parameter's text reads. */
typedef enum virga_type {
    VIRGA_NUMBER = 0,         /* "25" */
    VIRGA_NUMBER_OR_AUTO = 1, /* "180" or "auto" */
    VIRGA_WHOLE_NUMBER = 2,   /* "7" */
    VIRGA_SWITCH = 3,         /* "true" or "false"; as a number 1 or 0 */
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
    double default_numbers[3];
    size_t default_count; /* how many of them there are: 0 for texts and for "auto" */
} virga_parameter;

/* The table, in the order of the documentation. Parameters of the group "file" are about reading and writing files;
 * they are accepted and, but for "fps", "first-frame" and "ocio", change nothing here. */
VIRGA_API size_t virga_parameter_count(void);
/* A row; NULL if index is not under the count. It lives as long as the library. */
VIRGA_API const virga_parameter* virga_parameter_at(size_t index);

/* ---- Pictures --------------------------------------------------------------------------------------------------- */

typedef enum virga_layout {
    VIRGA_RGBA = 0,        /* interleaved, one plane */
    VIRGA_RGB = 1,         /* the same without alpha: opaque when read; alpha is left out when written */
    VIRGA_BGRA = 2,        /* as many hosts keep 8-bit pictures */
    VIRGA_GREY = 3,        /* one channel: depth; a plate without colour */
    VIRGA_RGBA_PLANES = 4, /* planes R, G, B, and A unless planes[3] is NULL */
    VIRGA_YUV420 = 5,      /* planes Y, Cb, Cr, and A unless planes[3] is NULL; 8 to 16 bits */
    VIRGA_YUV422 = 6,
    VIRGA_YUV444 = 7
} virga_layout;

typedef enum virga_samples {
    VIRGA_FLOAT = 0,
    VIRGA_HALF = 1,  /* IEEE 754 binary16; larger finite values are held at 65504 */
    VIRGA_UINT8 = 2, /* 0..255 for 0..1 */
    VIRGA_UINT16 = 3 /* of this machine's byte order; see significant_bits */
} virga_samples;

/* What Y, Cb and Cr mean (ITU-T H.273). */
typedef enum virga_matrix { VIRGA_BT709 = 0, VIRGA_BT601 = 1, VIRGA_BT2020 = 2 } virga_matrix;
/* Where chroma that pixels share was taken: for 4:2:0 and 4:2:2 that become pictures with chroma of their own. */
typedef enum virga_siting { VIRGA_SITING_LEFT = 0, VIRGA_SITING_CENTER = 1, VIRGA_SITING_TOP_LEFT = 2 } virga_siting;

/* A rectangle of pixels; x goes right, y down. */
typedef struct virga_window {
    int x, y, width, height;
} virga_window;

/* Pixels that the caller owns, and what they mean. virga_picture_default makes interleaved RGBA float,
 * packed rows, top row first, premultiplied, scene-linear, of the whole frame.
 *
 * Rows: planes[k] points to the top row's first sample. row_stride[k] is the number of bytes from one row to the next:
 * 0 for rows without gaps, negative for pictures that are kept bottom row first (the top row then lies last in memory).
 * Planes and strides are multiples of the sample's size. */
typedef struct virga_picture {
    size_t struct_size; /* sizeof(virga_picture), by which a later library knows what there is */
    virga_layout layout;
    virga_samples samples;
    int significant_bits; /* of UINT16, in the low bits: 10 for codes of 0..1023; of YUV 9..16. 0: all of the type */
    /* Where it lies in the frame at the request's scale: (x, y) is its first pixel. Zero width and height: the whole
     * frame for what is read, the request's region for what is written. With shared chroma x and y are multiples of the
     * pixels that share it. */
    virga_window window;
    void* planes[4]; /* not written through if the picture is read */
    ptrdiff_t row_stride[4];
    ptrdiff_t pixel_stride;  /* bytes from one pixel to the next in an interleaved or grey picture; 0: packed */
    const char* color_space; /* a name that docs/colour.md lists, or of $OCIO's configuration; NULL: scene-linear */
    int is_straight;         /* 1: colours are not multiplied by alpha; those of YUV never are */
    virga_matrix matrix;     /* of YUV */
    int is_full_range;       /* of YUV: 1 for 0..255, 0 for video levels, 16..235 and 16..240 */
    virga_siting siting;     /* of YUV420 and YUV422 that are read */
} virga_picture;

static inline virga_picture virga_picture_default(void)
{
    virga_picture picture;
    memset(&picture, 0, sizeof picture);
    picture.struct_size = sizeof picture;
    return picture;
}

/* ---- Shots ------------------------------------------------------------------------------------------------------ */

/* width, height: 1 to 16384 pixels. frames_per_second: over 0. *shot is NULL after an error. */
VIRGA_API virga_error virga_shot_create(int width, int height, double frames_per_second, virga_shot** shot);
/* Gives up what is being rendered and waits until that has ended. NULL is allowed. */
VIRGA_API void virga_shot_release(virga_shot* shot);

/* Sets a parameter from text as on the command line. Files are looked at when the next frame is rendered; what does not
 * depend on what changed is kept for it. */
VIRGA_API virga_error virga_shot_set(virga_shot* shot, const char* name, const char* text);
/* From numbers: one for numbers, whole numbers and switches, two or three for pairs and colours, none for "auto". */
VIRGA_API virga_error virga_shot_set_numbers(virga_shot* shot, const char* name, const double* values, size_t count);
/* From a settings document: TOML as `virga rain --settings` reads it, or, if it begins with '{', JSON with the same
 * keys, at the top or in an object named after their group. What it does not name stays. All of it or, after an error,
 * none. */
VIRGA_API virga_error virga_shot_set_document(virga_shot* shot, const char* text);

/* The parameter's present value; *text is valid until this is called again on the shot. */
VIRGA_API virga_error virga_shot_get(virga_shot* shot, const char* name, const char** text);
/* As numbers into values[0 .. capacity - 1]; *count is how many there are: 0 for "auto". Not of texts. */
VIRGA_API virga_error virga_shot_get_numbers(virga_shot* shot, const char* name, double* values, size_t capacity,
                                             size_t* count);
typedef enum virga_document { VIRGA_TOML = 0, VIRGA_JSON = 1 } virga_document;
/* All settings as a document that virga_shot_set_document reads back; *text is valid until this is called again. */
VIRGA_API virga_error virga_shot_get_document(virga_shot* shot, virga_document kind, const char** text);

/* Which device renders: "auto" (the default: a GPU if there is one, else the processor), "cpu" (the processor without
 * OpenGL), "gpu", or a number of `virga info`. A device that is not there, or is lost, is no error: the processor
 * stands in, which virga_shot_device says. */
VIRGA_API virga_error virga_shot_set_device(virga_shot* shot, const char* device);
/* What renders: the device's name, and why it is not the one that was asked for; "" before the first frame. *text is
 * valid until this is called again on the shot. */
VIRGA_API virga_error virga_shot_device(virga_shot* shot, const char** text);

/* Frames of the plate, whole and at scale 1, that stand for all of it. Without "env" the light comes from them, so that
 * it does not change from frame to frame; without them each frame is lit by itself and needs its whole plate.
 * "grade-from" compares a still with those that are added while it is set, and is an error without. The pixels are
 * copied; a second sample of a frame replaces the first. With the frames that virga_shot_samples_wanted names, all is
 * as `virga rain` has it. */
VIRGA_API virga_error virga_shot_add_plate_sample(virga_shot* shot, int64_t frame, const virga_picture* plate);
/* Forgets all samples. */
VIRGA_API virga_error virga_shot_clear_plate_samples(virga_shot* shot);
/* The frames of a plate with the frames first..last that had better be given as samples, as the settings are now, into
 * frames[0 .. capacity - 1]; *count is how many there are. */
VIRGA_API virga_error virga_shot_samples_wanted(virga_shot* shot, int64_t first, int64_t last, int64_t* frames,
                                                size_t capacity, size_t* count);

/* A panorama for the light in place of the file that "env" names (docs/env.md: equirectangular, or a layout that is
 * known by its shape). Its window is not looked at but for width and height, which must be given. The pixels are
 * copied; the same pixels once more change nothing. NULL: none. */
VIRGA_API virga_error virga_shot_set_environment(virga_shot* shot, const virga_picture* panorama);

/* *is_identity: 1 if the settings change no pixel of any frame; render then copies and opens no device. */
VIRGA_API virga_error virga_shot_is_identity(virga_shot* shot, int* is_identity);

/* ---- Frames ----------------------------------------------------------------------------------------------------- */

/* What a progress callback answers. */
enum { VIRGA_CONTINUE = 0, VIRGA_STOP = 1 };
/* Told on the library's own thread what share of the frame is done, 0 to 1. VIRGA_STOP gives the frame up. It may call
 * virga_shot_cancel and nothing else of this library. */
typedef int (*virga_progress)(void* user, double done);

/* What is asked for. virga_request_default asks for frame 0 at scale 1, whole, without
 * pictures. Pictures that
 * are NULL are not wanted. Layers are premultiplied and of scene-linear light unless their color_space says otherwise;
 * rain over (splash over (fog over graded_plate)) is the beauty, where a over b = a + (1 - a.A) b. */
typedef struct virga_request {
    size_t struct_size; /* sizeof(virga_request) */
    double frame;       /* exposed from frame / fps seconds on; 10.5 is half-way between two, for what is retimed */
    double scale;       /* of each side, over 0 to 1: a proxy of round(width * scale) x round(height * scale) pixels, in
                           which all windows are; 0 stands for 1 */
    virga_window region;        /* to be made; zero width and height: the whole frame */
    const virga_picture* plate; /* what is drawn over: at least what virga_shot_plate_needed says */
    /* Depth of the whole frame, of any size (docs/depth.md), in place of "depth": its first channel as the parameters
     * "depth-kind", "depth-scale" ... say; integers are their codes. Its window is not looked at but for width and
     * height, which must be given. NULL: as "depth" or "ground" say. */
    const virga_picture* depth;
    const virga_picture* beauty; /* this and those below are written inside the region alone. May be `plate` itself */
    const virga_picture *rain, *splash, *fog, *graded_plate;
    virga_progress progress; /* NULL: nobody */
    void* user;              /* for progress */
    int priority;            /* among frames that wait, of all shots, greater ones come first */
    uint64_t plate_content;  /* frames with the same number other than 0 have the same plate pixels, which saves work */
} virga_request;

static inline virga_request virga_request_default(void)
{
    virga_request request;
    memset(&request, 0, sizeof request);
    request.struct_size = sizeof request;
    return request;
}

/* Size of the frame at a scale: what windows are within. */
VIRGA_API virga_error virga_shot_frame_size(virga_shot* shot, double scale, int* width, int* height);
/* What of the plate the request's region needs, at its scale: the region, around it as far as a blur reaches, or the
 * whole frame if that lights the rain. `request` needs neither pictures nor a progress callback. Opens files and the
 * device, as a first frame does. */
VIRGA_API virga_error virga_shot_plate_needed(virga_shot* shot, const virga_request* request, virga_window* plate);

/* Renders a frame. The first one after a change of settings opens files and the device and takes longer. Nothing is
 * written before all of it is rendered. */
VIRGA_API virga_error virga_shot_render(virga_shot* shot, const virga_request* request);
/* Every render on the shot that has been called and has not returned ends soon, with VIRGA_ERROR_CANCELLED; later ones
 * are as ever. Does not wait; any thread. */
VIRGA_API virga_error virga_shot_cancel(virga_shot* shot);

/* Counts of the process since it began, for tests, benchmarks and monitors: "frames" rendered, "contexts" of OpenGL
 * opened, "programs" compiled, "environments" whose light was worked out. */
VIRGA_API virga_error virga_counter(const char* name, uint64_t* value);

#ifdef __cplusplus
}
#endif

#endif
