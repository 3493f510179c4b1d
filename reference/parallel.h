// Loops on all threads.
#pragma once

#include <cstddef>

#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <thread>
#include <vector>
#else
#include <oneapi/tbb/parallel_for.h>
#endif

namespace lobe {

// Calls body(i) for each i below count, in any order, on all threads at once.
template <class Body> void parallel_for(std::size_t count, const Body& body) {
#ifdef __SANITIZE_THREAD__
    // The sanitizer sees what orders std::thread, and nothing of what orders the tasks of a libtbb built without it.
    constexpr int THREADS = 4;
    std::atomic<std::size_t> next = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < THREADS; ++t)
        threads.emplace_back([&] {
            for (std::size_t i; (i = next++) < count;) body(i);
        });
    for (std::thread& t : threads) t.join();
#else
    oneapi::tbb::parallel_for(std::size_t(0), count, body);
#endif
}

}  // namespace lobe
