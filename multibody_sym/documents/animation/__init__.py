"""Animations: pages that play or compute a motion, and films.

    animate    `animate`: a page of HTML; a motion packed for the player in templates/html (player.html.in its
               controls, animation.js its clock and keys, plane.js and space.js its stages, plots.js, names.js)
    live       `live`: a page that computes the motion: live.js has its clock, sliders and curves, on the same stages
    frames     a run as frames of one projection, the window that follows a far motion, traced points; GIF and MP4
"""
