!> Whether two paths lead to one file.
module file_identity
  use text, only: string_t
  use system_files, only: true_path, kind_of_file
  implicit none
  private

  public :: is_same_file, is_any_of_files

contains

  !> Do both paths lead to the same file that is there? Links count as the file that they lead to;
  !! a file that is not there yet is the same as none.
  logical function is_same_file(one, other) result(is_same)
    character(*), intent(in) :: one, other
    character(:), allocatable :: kind
    integer :: unit, status, found

    is_same = one == other
    if (is_same) return
    kind = kind_of_file(one)
    if (kind == "") return
    is_same = true_path(one) == true_path(other)
    if (is_same .or. kind /= "file") return
    ! That leaves hard links. The library of gfortran knows an open file by device and inode, under
    ! whatever name it is asked for; one that goes by the name finds no unit.
    open (newunit=unit, file=one, status="old", action="read", iostat=status)
    if (status /= 0) return
    inquire (file=other, number=found)
    is_same = found == unit
    close (unit)
  end function is_same_file

  !> Does the path lead to one of these files?
  logical function is_any_of_files(path, files) result(is_any)
    character(*), intent(in) :: path
    type(string_t), intent(in) :: files(:)
    integer :: i

    is_any = .false.
    do i = 1, size(files)
      if (.not. is_any) is_any = is_same_file(path, files(i)%value)
    end do
  end function is_any_of_files

end module file_identity
