"""The arm that the cylinder moves: a beam with a load on a pivot, in moving sea water.

The plane of motion is x (horizontal), y (up). The pivot is the origin; theta is the beam's angle above the horizontal
x axis and grows when the cylinder extends. Positive current flows along +x, which pushes the arm towards retraction.
"""
