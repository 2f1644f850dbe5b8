"""What a scene is made of: parts at rest, parts that move as a whole, parts that bend or scatter.

The lecture's first rule for scenes that move is to divide them: static (no changes), structured
(affine transformations for groups of primitives), continuous (adjacent geometry stays adjacent)
and unstructured (arbitrary movement).
"""
