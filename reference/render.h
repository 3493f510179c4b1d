// Path tracing: light of all kinds, direct and by any number of reflections, sample after sample.
#pragma once

#include "camera.h"
#include "film.h"
#include "guide.h"
#include "outlook.h"
#include "scene.h"
#include "shares.h"

#include <map>
#include <string_view>
#include <vector>

namespace lobe {

enum class Strategy { mis, lobe, light };  // how directions to lights with an extent are drawn

struct RenderSettings {
    int depth = 8;     // interactions with surfaces on the longest path: 0 shows lights alone, 1 has direct light
    int roulette = 4;  // interactions before paths may end by chance
    std::uint64_t seed = 0;
    Strategy strategy = Strategy::mis;
    bool layers = false;   // one film for each light, too
    // Two independent halves of the samples tell the variance. Without, they are one sequence, which is a little more
    // even, but nobody knows how good it is.
    bool variance = true;
    bool adaptive = false;  // noisier pixels get more samples; there are two halves, then, in any case
    bool guided = true;     // towards light that comes through glass or off mirrors, by photons
    // Pixels that are near share the light that their paths find on Lambertian surfaces: see Render::companions().
    bool share = true;
};

using Outlooks = std::map<int, Outlook>;  // by breadth

// One picture that gets better as long as one likes. The scene must outlive it and must not change.
class Render {
public:
    Render(const Scene& scene, const Camera& camera, int width, int height, const RenderSettings& settings);

    // Adds so many samples to each pixel that is not finished, on an average where the render is adaptive. The result
    // depends neither on the number of threads nor on how the samples are split into calls. Throws std::invalid_argument where the scene has changed.
    void advance(int samples);
    // From now on, tiles are finished as soon as their relative standard error, the root mean square over their pixels
    // over the mean of the picture, is below, and all of them as soon as the picture's is; 0: never. That is looked at
    // after 2^n samples, and biases by as much as such rules do: a tile which happens to look even ends early.
    void set_target(double error) { target_ = settings_.variance ? error : 0; }
    bool finished() const;
    // Samples of the pixels that are not finished, on an average.
    int turns() const { return samples_; }
    // Bytes besides film, layers and shares that a guided render of the scene may take; the scene keeps a third of them.
    static std::size_t guide_bytes(const Scene& scene);
    // Bytes that each render of the scene takes to tell lobes where an environment has its light.
    static std::size_t outlook_bytes(const Scene& scene, Strategy strategy);

    const RenderSettings& settings() const { return settings_; }
    const Film& film() const { return film_; }
    // The pixels with which one shares light, itself included. Their noise is alike, and that of all others independent.
    Companions companions(int x, int y) const {
        return shares_light_ ? Companions::of(x, y, film_.width, film_.height) : Companions::none(x, y);
    }
    // For each light a picture, all of whose sum is the beauty.
    const std::vector<Film::Sums>& layers() const { return layers_; }

    // All that a render of the same scene, camera, size and settings needs to go on as if it had not been stopped.
    // A film of 8k has gigabytes: the caller brings state_size() bytes for it.
    std::size_t state_size() const;
    void state(char* bytes) const;
    // Throws std::invalid_argument where the state is another's, of another version, or damaged; then nothing has changed.
    void restore(std::string_view state);

private:
    static constexpr std::size_t FEWEST_PHOTONS = 1 << 16, MOST_PHOTONS = 1 << 20;

    void add_samples(int count);
    void aim();
    void finish_tiles();
    int halves() const { return settings_.variance || settings_.adaptive ? Film::HALVES : 1; }
    int due(std::size_t pixel, int half, int turns) const;
    // Hands the arrays that make up the state to visit(data, count).
    template <class Self, class Visit> static void for_state(Self& self, const Visit& visit) {
        self.film_.for_state(visit);
        for (auto& layer : self.layers_) visit(layer.data(), layer.size());
        if (self.shares_) self.shares_->for_state(visit);
    }

    const Scene& scene_;
    View view_;
    RenderSettings settings_;
    int version_;
    std::uint64_t fingerprint_;
    Film film_;
    std::vector<Film::Sums> layers_;
    std::optional<Shares> shares_;
    bool shares_light_;
    std::shared_ptr<const Guide> guide_ = std::make_shared<const Guide>();
    Outlooks outlooks_;  // of all lobes, where the environment has details and is drawn from
    std::int32_t samples_ = 0;  // of the pixels of tiles that are not finished, on an average
    double target_ = 0;
};

}  // namespace lobe
