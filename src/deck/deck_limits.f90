!> How much a deck may hold. What is beyond is no deck that anyone writes but a mistake, or files
!! that are to fill the memory: reading stops there with an error.
module deck_limits
  implicit none
  private

  integer, parameter, public :: most_levels = 20            !! files within each other
  integer, parameter, public :: most_files = 1000           !! opened in all, each time counting
  integer, parameter, public :: most_lines = 10000000       !! of all files
  !> Characters of all files, and of all data lines with their parameters replaced.
  integer, parameter, public :: most_characters = 2**27
  !> Of a line with those that continue it and its parameters replaced.
  integer, parameter, public :: longest_line = 500000
  integer, parameter, public :: most_options = 1000         !! of a keyword
  integer, parameter, public :: longest_name = 255          !! of what a deck gives a name to

end module deck_limits
