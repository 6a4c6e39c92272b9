// What the desktop and earlier starts say about the window.
#pragma once

namespace pbm {

// Whether the desktop asks its programs to be light. False if it asks for dark ones or says nothing: then dark is the
// default. Asks the desktop's settings portal (org.freedesktop.appearance, color-scheme) by gdbus, which takes some
// milliseconds, and two seconds where the desktop hangs.
bool desktop_prefers_light();

// Whether this user starts the program for the first time; a file in $XDG_STATE_HOME/pbm remembers. False where it
// cannot be remembered, so that a hint is not shown every time.
bool is_first_start();

} // namespace pbm
