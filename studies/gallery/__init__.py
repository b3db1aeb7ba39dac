"""The project's pages and its figures as a site.

``pages`` holds the text, whose examples are tests. A page of the gallery is made from its study: the docstring is its
text, ``draw`` its picture, the sidecar its numbers, the source its code. Sphinx makes HTML of both, to be read offline.
"""
