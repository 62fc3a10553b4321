"""The manual's page on quadrature rules is what the program prints.

usage: rules_page.py IGAFORM PAGE
"""
import subprocess
import sys

printed = subprocess.run([sys.argv[1], "--rules"], check=True, capture_output=True,
                         text=True).stdout
with open(sys.argv[2], encoding="utf-8") as page:
    sys.exit(0 if page.read() == printed else f"{sys.argv[2]} is not what --rules prints now")
