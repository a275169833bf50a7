#!/usr/bin/env bash
# Gradescope runs this once, as root, when it builds the image of the autograder.
exec bash /autograder/source/tb3_labs/scripts/setup.sh
