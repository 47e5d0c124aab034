"""Animations: pages that play, and films.

    animate    `animate`: HTML, GIF or MP4; Play, slider, choice of speeds; plots beside the motion;
               a motion packed for the player in templates/html (plane.js, space.js, animation.js)
    frames     a run as frames of one projection, and the points that are traced
"""
