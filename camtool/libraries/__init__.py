"""Objects of other libraries as drawings, and back: `read` finds the library of an object, a file
for each library reads it, and `exports` makes objects of drawings and toolpaths."""
