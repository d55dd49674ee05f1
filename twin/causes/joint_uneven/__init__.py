"""The contact fades along the overlap: the bolt is off its place, or the faces are not parallel."""
