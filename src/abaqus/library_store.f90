!> The compiled subroutines that earlier runs have kept in the user's cache.
module library_store
  use text, only: lower_case
  use whole_file, only: read_whole_file
  use trusted_files, only: open_own_file, close_file, path_of, digest_of
  implicit none
  private

  public :: find_kept, library_name

  integer, parameter :: digest_length = 64   ! of the text

contains

  !> The library of these sources that an earlier run has kept, open; below zero if there is none.
  !! A record of this user has its digest and the note, which each run prints. What is no
  !! plain file of this user, or has another digest, is no library: it will be made again.
  subroutine find_kept(cache, key, library, note)
    character(*), intent(in) :: cache, key
    integer, intent(out) :: library
    character(:), allocatable, intent(out) :: note
    character(:), allocatable :: content
    integer :: record
    logical :: is_there

    note = ""
    library = -1
    record = open_own_file(cache//"/"//key//".txt")
    if (record < 0) return
    call read_whole_file(path_of(record), content, is_there)
    call close_file(record)
    if (len(content) < digest_length) return
    library = open_own_file(cache//"/"//library_name(content(:digest_length)))
    if (library < 0) return
    note = content(digest_length + 1:)
    if (digest_of(library) == content(:digest_length)) return
    call close_file(library)
    library = -1
    note = ""
  end subroutine find_kept

  !> The name of a library that has this digest.
  pure function library_name(digest) result(name)
    character(*), intent(in) :: digest
    character(:), allocatable :: name

    name = "user_"//lower_case(digest)//".so"
  end function library_name

end module library_store
