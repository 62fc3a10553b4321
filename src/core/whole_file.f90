!> Text files that are there as a whole or not at all.
module whole_file
  use, intrinsic :: iso_fortran_env, only: int64
  use text, only: string_t
  use system_files, only: true_path, sync_file, replace_file, remove_file, bytes_on_disk, &
                          why_protected, is_no_file, draft_ending
  implicit none
  private

  public :: write_lines, read_whole_file, is_of_size

contains

  !> Write lines to a file of their own, bring it to the disk, and put it in the place of an older
  !! one, where the name leads to. On failure that stays.
  subroutine write_lines(path, lines, why)
    character(*), intent(in) :: path
    type(string_t), intent(in) :: lines(:)
    character(:), allocatable, intent(out) :: why   !! what failed; empty if nothing did
    character(:), allocatable :: new, reason
    character(256) :: message
    integer(int64) :: n_bytes
    integer :: unit, status, i

    why = why_protected(path)
    if (why /= "") then
      why = "cannot write it: "//why
      return
    end if
    new = true_path(path)//draft_ending
    call remove_file(new)
    open (newunit=unit, file=new, action="write", status="replace", iostat=status, iomsg=message)
    if (status == 0) then
      n_bytes = 0
      do i = 1, size(lines)
        if (status == 0) write (unit, "(a)", iostat=status, iomsg=message) lines(i)%value
        n_bytes = n_bytes + len(lines(i)%value) + 1
      end do
      if (status == 0) close (unit, iostat=status, iomsg=message)
      if (status /= 0) close (unit, iostat=i)
    end if
    if (status /= 0) then
      why = "cannot write it: "//trim(message)
    else if (.not. is_of_size(new, n_bytes)) then
      why = "cannot write all of it; is the disk full?"
    else if (.not. sync_file(new, reason)) then
      why = "cannot bring it to the disk: "//reason
    else if (.not. replace_file(new, true_path(path), reason)) then
      why = "cannot put it in its place: "//reason
    end if
    if (why /= "") call remove_file(new)
  end subroutine write_lines

  !> Has the file all bytes that were written to it? WRITE and CLOSE of gfortran tell nothing of
  !! those that a full disk did not take.
  logical function is_of_size(path, n_bytes)
    character(*), intent(in) :: path
    integer(int64), intent(in) :: n_bytes

    is_of_size = bytes_on_disk(path) == n_bytes
  end function is_of_size

  !> A file as one text; empty if it cannot be read or is no plain file.
  subroutine read_whole_file(path, content, is_there)
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: content
    logical, intent(out) :: is_there
    integer :: unit, status, length

    content = ""
    is_there = .false.
    if (is_no_file(path)) return
    open (newunit=unit, file=path, access="stream", form="unformatted", action="read", &
          status="old", iostat=status)
    if (status /= 0) return
    inquire (unit=unit, size=length)
    deallocate (content)
    allocate (character(max(0, length)) :: content)
    read (unit, iostat=status) content
    is_there = status == 0
    if (.not. is_there) content = ""
    close (unit)
  end subroutine read_whole_file

end module whole_file
