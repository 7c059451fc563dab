/* Rain on one picture: a binary PPM in, one out.
 *
 *   cc rain_on_a_frame.c -o rain_on_a_frame $(pkg-config --cflags --libs virga)
 *   ffmpeg -i street.png street.ppm && ./rain_on_a_frame street.ppm rainy.ppm 40
 */
#include <stdio.h>
#include <stdlib.h>
#include <virga/virga.h>

static int fail(const char* sentence)
{
    fprintf(stderr, "rain_on_a_frame: %s\n", sentence);
    return EXIT_FAILURE;
}

/* The pixels of an 8-bit PPM, 3 bytes each; NULL if it is none. */
static unsigned char* read_ppm(const char* path, int* width, int* height)
{
    FILE* file = fopen(path, "rb");
    unsigned char* pixels = NULL;
    int largest = 0;
    if (file == NULL) return NULL;
    if (fscanf(file, "P6 %d %d %d", width, height, &largest) == 3 && largest == 255 && fgetc(file) != EOF &&
        *width > 0 && *height > 0 && *width <= 16384 && *height <= 16384) {
        const size_t bytes = 3 * (size_t)*width * (size_t)*height;
        pixels = malloc(bytes);
        if (pixels != NULL && fread(pixels, 1, bytes, file) != bytes) {
            free(pixels);
            pixels = NULL;
        }
    }
    fclose(file);
    return pixels;
}

static int write_ppm(const char* path, const unsigned char* pixels, int width, int height)
{
    FILE* file = fopen(path, "wb");
    const size_t bytes = 3 * (size_t)width * (size_t)height;
    int whole = 0;
    if (file == NULL) return 0;
    whole = fprintf(file, "P6\n%d %d\n255\n", width, height) > 0 && fwrite(pixels, 1, bytes, file) == bytes;
    return fclose(file) == 0 && whole;
}

int main(int count, char** words)
{
    virga_shot* shot = NULL;
    virga_picture picture = virga_picture_default();
    virga_request request = virga_request_default();
    const char* device = NULL;
    int width = 0, height = 0;
    unsigned char* pixels;

    if (count != 4) return fail("usage: rain_on_a_frame IN.ppm OUT.ppm RATE");
    pixels = read_ppm(words[1], &width, &height);
    if (pixels == NULL) return fail("the first file is no 8-bit PPM");

    if (virga_shot_create(width, height, 24, &shot) != VIRGA_OK) return fail(virga_error_sentence());
    if (virga_shot_set(shot, "rate", words[3]) != VIRGA_OK) return fail(virga_error_sentence());

    picture.layout = VIRGA_RGB;
    picture.samples = VIRGA_UINT8;
    picture.color_space = "sRGB";
    picture.planes[0] = pixels;
    request.plate = request.beauty = &picture; /* over itself */
    if (virga_shot_render(shot, &request) != VIRGA_OK) return fail(virga_error_sentence());

    if (!write_ppm(words[2], pixels, width, height)) return fail("the second file cannot be written");
    if (virga_shot_device(shot, &device) == VIRGA_OK) printf("drawn by %s\n", device);
    virga_shot_release(shot);
    free(pixels);
    return EXIT_SUCCESS;
}
