// The user's edits of lights, materials and shading: their shadows, and how they are kept in the model's file, in a
// recipe, in options.
#pragma once

#include "viewer/pbm-view/drawing/pictures.h"
#include "viewer/pbm-view/light/moved_shadows.h"

#include <future>
#include <optional>
#include <string>

namespace pbm {

class SceneEdits {
  public:
    // All outlive it. `worker` bakes and saves.
    SceneEdits(Shown &shown, Pictures &pictures, Notices &notices, Window &window, ThreadPool &worker);

    // Another model is shown, with the look of its file.
    void show_model();
    void change(Look look);
    // Raking light: moves a light, or the headlight, to where the pointer (picture heights from the upper left corner)
    // is on a ball that fills the picture's height. A light that follows the eye then stays there.
    void rake(glm::dvec2 pointer, std::size_t light);

    // Whether lights or materials were changed and not saved.
    bool is_unsaved() const;
    void discard() { kept_ = shown_.look->appearance; }
    // Puts the command that draws this picture on the clipboard, and the builder's options where lights or materials
    // were changed.
    void copy() const;
    // Saves into the model's file, once moved lights have their shadows.
    void save();
    void save_recipe();
    // Whether the file is written at present, and whether it will be once shadows are baked.
    bool is_saving() const { return save_.valid(); }
    bool waits_to_save() const { return saves_after_baking_; }
    // Whether the file that is opened again was written by `save`; once.
    bool take_was_saved() { return std::exchange(was_saved_, false); }

    // Bakes the shadows of lights that were moved, and reports what was baked and saved.
    void serve();
    // Reports a model that was saved or could not be. `wait`: until it is done.
    void receive_save(bool wait);
    // When `serve` has something to start; absent: not before something else happens.
    std::optional<double> due() const { return shadows_.due(); }
    // The light whose shadows are baked.
    std::optional<std::size_t> baking() const { return shadows_.baking(); }
    // How the shadows of a light stand; empty if there is nothing to say.
    std::string shadow_note(std::size_t light) const;

  private:
    Look look_to_keep() const;

    Shown &shown_;
    Pictures &pictures_;
    Notices &notices_;
    Window &window_;
    ThreadPool &worker_;
    MovedShadows shadows_;
    std::optional<Appearance> kept_; // of the file, or as it was saved last
    Bytes header_;                   // of the file when it was opened or saved last
    std::future<Result<Bytes>> save_;
    std::optional<Appearance> saved_; // what `save_` writes
    bool was_saved_ = false;          // by this window, and not opened again since
    bool saves_after_baking_ = false; // what is to be saved lacks shadows that are baked
};

} // namespace pbm
