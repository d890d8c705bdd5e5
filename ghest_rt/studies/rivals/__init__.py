"""What others do to learn the GH angles, as estimators under the same interface: what method `fused` is compared with.

Which rival rests on which publication, and what each is given to know, is in docs/rivals.md.
"""
