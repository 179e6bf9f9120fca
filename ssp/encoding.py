"""Bytes of strangers as text: XML files that declare no or a wrong encoding, names in archives that say none."""

from __future__ import annotations

import codecs
import re
import unicodedata
import zipfile

DECLARED = re.compile(rb"""<\?xml[^>]{0,200}?\bencoding\s*=\s*["']([A-Za-z0-9._-]+)["']""")

MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"), (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"),
    (b"<\0", "utf-16-le"), (b"\0<", "utf-16-be"),
)  # fmt: skip
"""What the bytes of a file begin with in an encoding that shows by it."""

UNTOLD = ("cp1252", "latin-1")
"""Encodings that are tried where none is declared that can be, and the bytes are no UTF-8."""

ENCODINGS = re.compile(r"(utf|us-?ascii|iso|latin|windows|cp|ibm|koi8|mac|shift|s?jis|euc|gb|big5)", re.IGNORECASE)
"""How names of encodings of texts begin; Python knows others by which a stranger could do harm."""

WIDE = re.compile(r"(utf|iso-10646)-?_?(16|32|ucs)", re.IGNORECASE)
"""Encodings with more than a byte for a plain letter."""

OF_ARCHIVES = ("cp1252", "cp850", "latin-1", "shift_jis", "gbk")
"""Encodings of names in archives that old tools use, though the format knows cp437 and UTF-8 only."""


def as_utf8(data: bytes) -> tuple[bytes, str]:
    """An XML file's bytes in UTF-8, and the encoding that they are in where it is another than they declare, else ''.

    Whoever parses them has to take UTF-8 for granted, whatever the declaration says.
    """
    for mark, name in MARKS:
        if data.startswith(mark):
            text = _decoded(data, name)
            return (data if text is None else text.encode()), ""
    declaration = DECLARED.match(data)
    declared = declaration[1].decode() if declaration else "utf-8"
    narrow = data.isascii() and not WIDE.match(declared)
    for name in (*([declared] if narrow else []), "utf-8", declared, *UNTOLD):
        if (text := _decoded(data, name)) is not None:
            return data if _is_one(name, "utf-8") else text.encode(), "" if _is_one(name, declared) else name
    return data, ""


def _is_one(name: str, other: str) -> bool:
    try:
        return codecs.lookup(name) == codecs.lookup(other)
    except LookupError:
        return False


def _decoded(data: bytes, name: str) -> str | None:
    """The text; None where the bytes are not in that encoding, or it is none that is known."""
    try:
        return data.decode(name) if ENCODINGS.match(name) else None
    except (LookupError, ValueError):
        return None


def name_in(entry: zipfile.ZipInfo) -> str:
    """The name of an archive's entry, composed; many tools write UTF-8 and do not say so."""
    name = entry.filename
    if not entry.flag_bits & 0x800 and not name.isascii():
        name = _decoded(name.encode("cp437"), "utf-8") or name
    return unicodedata.normalize("NFC", name)


def encoding_of(name: str, meant: str) -> str | None:
    """The encoding in which an archive has a name, where that would make of `name` the one that is meant."""
    try:
        data = name.encode("cp437")
    except ValueError:
        return None
    return next((other for other in OF_ARCHIVES if _decoded(data, other) == meant), None)
