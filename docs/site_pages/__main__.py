"""`PYTHONPATH=docs python -m site_pages` writes the files of the checkout that code makes."""

from site_pages import verification
from site_pages.written import MOVING, moving_picture, written

for path, text in written().items():
    path.write_text(text(), encoding="utf-8")
MOVING.write_bytes(moving_picture())
verification.PAGE.write_text(verification.page(), encoding="utf-8")
