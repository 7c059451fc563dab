// Many threads at once: on one shot and on several, with cancelling, changing and releasing. Also for the thread
// sanitizer (scripts/sanitize_threads.sh).
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <random>
#include <thread>

#include "Caller.h"

namespace virga::test {
namespace {

constexpr int width = 32, height = 24;

class Threads : public testing::Test {
protected:
    Threads() : plate(width, height) { paint(plate); }
    std::vector<std::unique_ptr<Frame>> truths(virga_shot* shot, int frames)
    {
        std::vector<std::unique_ptr<Frame>> all;
        for (int i = 0; i < frames; ++i) {
            all.push_back(std::make_unique<Frame>(width, height));
            EXPECT_EQ(render(shot, i, plate, *all.back()), VIRGA_OK) << virga_error_sentence();
        }
        return all;
    }
    Frame plate;
};

TEST_F(Threads, GetTheSameFramesFromOneShotAndFromMany)
{
    const ShotPointer shared = smallShot(width, height);
    const auto wanted = truths(shared.get(), 6);
    std::vector<std::thread> threads;
    std::atomic<int> wrong = 0;
    for (int t = 0; t < 6; ++t)
        threads.emplace_back([&, t] {
            const ShotPointer own = smallShot(width, height);
            virga_shot* const shot = t % 2 == 0 ? shared.get() : own.get();
            std::mt19937 random{unsigned(t)};
            Frame beauty(width, height);
            for (int i = 0; i < 12; ++i) {
                const int number = int(random() % 6);
                if (render(shot, number, plate, beauty) != VIRGA_OK ||
                    beauty.planes() != wanted[std::size_t(number)]->planes())
                    ++wrong;
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
}

// Frames are of the old settings or of the new ones, never of both.
TEST_F(Threads, MayChangeSettingsWhileOthersRender)
{
    const ShotPointer shot = smallShot(width, height);
    Frame light(width, height), heavy(width, height);
    ASSERT_EQ(virga_shot_set_document(shot.get(), "rate = 150\nwind = [5, 0]"), VIRGA_OK);
    ASSERT_EQ(render(shot.get(), 0, plate, heavy), VIRGA_OK);
    ASSERT_EQ(virga_shot_set_document(shot.get(), "rate = 30\nwind = [0, 0]"), VIRGA_OK);
    ASSERT_EQ(render(shot.get(), 0, plate, light), VIRGA_OK);
    std::atomic<bool> ends = false;
    std::thread changer([&] {
        for (int i = 0; !ends; ++i) {
            const char* text = i % 2 == 0 ? "{\"rate\": 150, \"wind\": [5, 0]}" : "{\"rate\": 30, \"wind\": [0, 0]}";
            virga_shot_set_document(shot.get(), text);
            const char* got = nullptr;
            virga_shot_get(shot.get(), "rate", &got);
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    });
    std::vector<std::thread> threads;
    std::atomic<int> wrong = 0;
    for (int t = 0; t < 3; ++t)
        threads.emplace_back([&] {
            Frame beauty(width, height);
            for (int i = 0; i < 10; ++i) {
                if (render(shot.get(), 0, plate, beauty) != VIRGA_OK ||
                    (beauty.planes() != light.planes() && beauty.planes() != heavy.planes()))
                    ++wrong;
            }
        });
    for (std::thread& thread : threads) thread.join();
    ends = true;
    changer.join();
    EXPECT_EQ(wrong, 0);
}

/// A render that holds the library's thread until it is let go.
struct Held {
    std::mutex mutex;
    std::condition_variable changed;
    bool hasBegun = false, mayGoOn = false;

    static int progress(void* user, double)
    {
        auto& held = *static_cast<Held*>(user);
        std::unique_lock lock(held.mutex);
        held.hasBegun = true;
        held.changed.notify_all();
        held.changed.wait(lock, [&] { return held.mayGoOn; });
        return VIRGA_CONTINUE;
    }
    void waitForBegin()
    {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return hasBegun; });
    }
    void letGo()
    {
        const std::lock_guard lock(mutex);
        mayGoOn = true;
        changed.notify_all();
    }
};

TEST_F(Threads, CancelWhatRendersAndWhatWaits)
{
    const ShotPointer busy = smallShot(width, height), other = smallShot(width, height);
    Frame beauty(width, height), warm(width, height);
    ASSERT_EQ(render(other.get(), 0, plate, warm), VIRGA_OK);
    ASSERT_EQ(render(busy.get(), 0, plate, warm), VIRGA_OK);
    const auto untouched = beauty.planes();
    Held held;
    virga_request request = virga_request_default();
    request.plate = &plate.picture;
    request.beauty = &beauty.picture;
    request.progress = Held::progress;
    request.user = &held;
    virga_error running = VIRGA_OK;
    std::thread renders([&] { running = virga_shot_render(busy.get(), &request); });
    held.waitForBegin();
    // Another shot's frame waits for the thread that is held, and is given up without it; several on one shot too.
    std::atomic<int> cancelled = 0;
    std::atomic<bool> isOver = false;
    std::vector<std::thread> waiting;
    for (int t = 0; t < 3; ++t)
        waiting.emplace_back([&] {
            Frame mine(width, height);
            if (render(other.get(), 1, plate, mine) == VIRGA_ERROR_CANCELLED) ++cancelled;
        });
    std::thread canceller([&] {
        while (!isOver) {
            virga_shot_cancel(other.get());
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    });
    for (std::thread& thread : waiting) thread.join();
    isOver = true;
    canceller.join();
    EXPECT_EQ(cancelled, 3);
    EXPECT_EQ(virga_shot_error(other.get(), nullptr), VIRGA_ERROR_CANCELLED);

    ASSERT_EQ(virga_shot_cancel(busy.get()), VIRGA_OK);
    held.letGo();
    renders.join();
    EXPECT_EQ(running, VIRGA_ERROR_CANCELLED);
    EXPECT_EQ(beauty.planes(), untouched);

    // What comes later is as ever.
    for (const ShotPointer* shot : {&busy, &other}) {
        ASSERT_EQ(render(shot->get(), 0, plate, beauty), VIRGA_OK) << virga_error_sentence();
        EXPECT_EQ(beauty.planes(), warm.planes());
    }
}

TEST_F(Threads, GreaterPrioritiesComeFirst)
{
    const ShotPointer busy = smallShot(width, height), low = smallShot(width, height), high = smallShot(width, height);
    Frame a(width, height), b(width, height), c(width, height);
    for (const ShotPointer* shot : {&busy, &low, &high}) ASSERT_EQ(render(shot->get(), 0, plate, a), VIRGA_OK);
    Held held;
    virga_request request = virga_request_default();
    request.plate = &plate.picture;
    request.beauty = &a.picture;
    request.progress = Held::progress;
    request.user = &held;
    std::thread first([&] { virga_shot_render(busy.get(), &request); });
    held.waitForBegin();
    std::atomic<int> place = 0;
    int lowPlace = 0, highPlace = 0;
    struct Place {
        std::atomic<int>* next;
        int* mine;
    } lowUser{&place, &lowPlace}, highUser{&place, &highPlace};
    const auto begin = [&](const ShotPointer& shot, Frame& beauty, int priority, Place* user) {
        return std::thread([&shot, &beauty, priority, user, this] {
            virga_request r = virga_request_default();
            r.plate = &plate.picture;
            r.beauty = &beauty.picture;
            r.priority = priority;
            r.user = user;
            r.progress = [](void* given, double done) -> int {
                auto& p = *static_cast<Place*>(given);
                if (done == 0 && *p.mine == 0) *p.mine = ++*p.next;
                return VIRGA_CONTINUE;
            };
            virga_shot_render(shot.get(), &r);
        });
    };
    std::thread lows = begin(low, b, -5, &lowUser);
    // Nobody tells from outside when they wait in the queue: so long that they do on a busy machine, too.
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    std::thread highs = begin(high, c, 5, &highUser);
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    held.letGo();
    first.join(), lows.join(), highs.join();
    EXPECT_EQ(highPlace, 1);
    EXPECT_EQ(lowPlace, 2);
}

TEST_F(Threads, ComeAndGoWithTheirShots)
{
    std::vector<std::thread> threads;
    std::atomic<int> wrong = 0;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            std::mt19937 random{unsigned(t)};
            Frame beauty(width, height);
            for (int i = 0; i < 12; ++i) {
                const ShotPointer shot = smallShot(width, height);
                std::thread canceller;
                if (random() % 3 == 0) canceller = std::thread([&] { virga_shot_cancel(shot.get()); });
                const virga_error code = render(shot.get(), i, plate, beauty);
                if (code != VIRGA_OK && code != VIRGA_ERROR_CANCELLED) ++wrong;
                if (random() % 4 == 0 && virga_shot_set(shot.get(), "rate", "x") == VIRGA_OK) ++wrong;
                if (canceller.joinable()) canceller.join();
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace virga::test
