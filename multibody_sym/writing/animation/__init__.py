"""Animations: a run as a page of HTML that needs nothing beside it, or as a GIF or MP4.

What comes in: a Trajectory, whose samples become poses of the bodies of its scene. In the page poses, ropes and curves
are packed (int16); what a plane mechanism's bodies carry is drawn once, as in its figure, and moved as SVG, and space
is shown by three.js. The scripts are `templates/html`; a page asks for nothing from elsewhere.
"""
