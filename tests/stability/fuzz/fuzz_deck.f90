!> Reads decks, and builds the models of small ones, path by path from the standard input, for
!! fuzz.py.
program fuzz_deck
  use input_errors, only: error_list_t, n_errors
  use text, only: string_t
  use scene, only: scene_t
  use knot_vector, only: n_spans
  use deck_reader, only: read_deck, read_material_deck
  use model, only: model_t
  use model_setup, only: build_model
  use fuzz_talk, only: next_path, answer_with
  implicit none

  integer, parameter :: most_elements = 40, most_points = 5000   ! a model within a second
  character(:), allocatable :: path

  do
    call next_path(path)
    if (.not. allocated(path)) exit
    call read_one(path)
  end do

contains

  subroutine read_one(path)
    character(*), intent(in) :: path
    type(scene_t) :: scene
    type(model_t) :: model
    type(error_list_t) :: errors
    type(string_t) :: overrides(0)
    character(:), allocatable :: answer

    call read_material_deck(path, overrides, .true., scene, errors)
    answer = "refused"
    if (n_errors(errors) == 0) answer = "material"
    call read_deck(path, overrides, scene, errors)
    if (n_errors(errors) == 0) then
      answer = "read"
      if (is_small(scene)) then
        call build_model(scene, model, errors)
        answer = "built"
        if (n_errors(errors) > 0) answer = "not built"
      end if
    end if
    if (errors%n_items > 0) answer = answer//", "//errors%items(1)%expected
    call answer_with(answer)
  end subroutine read_one

  logical function is_small(scene)
    type(scene_t), intent(in) :: scene
    integer :: i, j, n_elements, n_points

    n_elements = 0
    n_points = 0
    do i = 1, size(scene%blank%patches)
      associate (axes => scene%blank%patches(i)%solid%axes)
        n_elements = n_elements + n_spans(axes(1))*n_spans(axes(2))*n_spans(axes(3))
      end associate
    end do
    do i = 1, size(scene%tools)
      do j = 1, size(scene%tools(i)%surfaces)
        n_points = n_points + size(scene%tools(i)%surfaces(j)%weights)
      end do
    end do
    is_small = n_elements <= most_elements .and. n_points <= most_points
  end function is_small

end program fuzz_deck
